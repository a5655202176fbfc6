// The program in the page, folded: a link to a line opens it there.

const listing = document.getElementById('listing');

function listed(line) {
  return listing && document.getElementById(`L${line}`);
}

function openLine(line, focus) {
  const item = listed(line);
  if (!item) return false;
  item.closest('details').open = true;
  for (const other of listing.querySelectorAll('.chosen')) other.classList.remove('chosen');
  item.classList.add('chosen');
  listing.scrollTop = item.offsetTop - listing.clientHeight / 3;
  if (focus) {
    listing.closest('section').scrollIntoView({ block: 'start' });
    listing.focus({ preventScroll: true });
  }
  return true;
}

if (listing) {
  document.addEventListener('click', (event) => {
    const link = event.target.closest('a[href^="#L"]');
    if (link && openLine(+link.hash.slice(2), true)) event.preventDefault();
  });
  document.getElementById('versions').addEventListener('change', (event) => {
    listing.classList.toggle('before', event.target.value === 'before');
    listing.classList.toggle('after', event.target.value === 'after');
  });
  if (/^#L\d+$/.test(location.hash)) openLine(+location.hash.slice(2), true);
}
