// Tables that sort by a click on a head, and filter by words where they are long.

const FILTERED = 8; // rows from which on a table has a filter

// What a cell is sorted by: its number, else its text.
function sortKey(row, at) {
  const text = row.cells[at]?.innerText.trim() ?? '';
  const value = Number.parseFloat(text.replace(/^[±≥≤~\s]+/, ''));
  return { text, value: Number.isFinite(value) && /^[^a-z]*\d/i.test(text) ? value : null };
}

function compare(a, b) {
  if (a.value !== null && b.value !== null) return a.value - b.value;
  if (a.value !== null || b.value !== null) return a.value === null ? 1 : -1;
  return a.text.localeCompare(b.text, undefined, { numeric: true });
}

function sortable(table, body) {
  const heads = [...table.tHead.rows[0].cells];
  const order = [...body.rows];
  heads.forEach((head, at) => {
    if (!head.textContent.trim()) return;
    const button = document.createElement('button');
    button.type = 'button';
    button.className = 'sort';
    button.append(...head.childNodes);
    head.append(button);
    button.addEventListener('click', () => {
      const now = head.getAttribute('aria-sort');
      const next = now === 'ascending' ? 'descending' : now === 'descending' ? null : 'ascending';
      for (const other of heads) other.removeAttribute('aria-sort');
      if (next) head.setAttribute('aria-sort', next);
      const keys = new Map(order.map((row) => [row, sortKey(row, at)]));
      const rows = next ? [...order].sort((a, b) => (next === 'ascending' ? 1 : -1) * compare(keys.get(a), keys.get(b))) : order;
      body.append(...rows);
    });
  });
}

function filterable(table, body) {
  const label = document.createElement('label');
  const input = document.createElement('input');
  const said = document.createElement('output');
  label.className = 'filter';
  input.type = 'search';
  label.append('show rows with ', input, ' ', said);
  (table.closest('.wide') ?? table).before(label);
  const rows = [...body.rows];
  input.addEventListener('input', () => {
    const words = input.value.toLowerCase().split(/\s+/).filter(Boolean);
    let shown = 0;
    for (const row of rows) {
      const text = row.innerText.toLowerCase();
      row.hidden = !words.every((word) => text.includes(word));
      shown += row.hidden ? 0 : 1;
    }
    said.textContent = words.length ? `${shown} of ${rows.length} rows` : '';
  });
}

for (const table of document.querySelectorAll('table')) {
  const body = table.tBodies[0];
  if (!table.tHead || !body || table.tBodies.length > 1 || table.querySelector('[colspan]')) continue;
  if (body.rows.length > 1) sortable(table, body);
  if (body.rows.length >= FILTERED) filterable(table, body);
}
