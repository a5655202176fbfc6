"""``compensate check``: read a program and report what is not understood."""

from __future__ import annotations

from pathlib import Path

import click

from postproc.cli.common import Out, language_options, page_option, result_options


@click.command()
@click.argument("program", type=click.Path(path_type=Path), required=False)
@click.option("--dump", is_flag=True, help="Print the canonical list of motions (mm, deg), one per line.")
@click.option("--list-codes", is_flag=True, help="List the codes of all findings.")
@click.option("--explain", metavar="CODE", help="Explain the code of a finding.")
@language_options
@page_option
@result_options
def check(
    program: Path | None,
    cell: Path | None,
    config_dat: Path | None,
    dump: bool,
    list_codes: bool,
    explain: str | None,
    page: Path | None,
    json_to: str | None,
    quiet: bool,
    verbose: bool,
) -> None:
    """Read PROGRAM only, and report findings with line and column, and a summary of its motions.

    \b
    Examples:
      compensate check panel.src
      compensate check panel.src --dump
      compensate check --explain KRL007

    Exit codes: 0 everything understood; 3 findings; 1 unreadable; 2 wrong command line.
    """
    from postproc.base.findings import nearest
    from postproc.codes import ALL as CODES

    if list_codes:
        for name, listed in CODES.items():
            click.echo(f"{name} {listed.severity:7} {listed.title}")
        return
    if explain:
        code = CODES.get(explain.upper())
        if code is None:
            raise click.UsageError(f"the code {explain!r} is unknown{nearest(explain.upper(), CODES)}")
        click.echo(f"{explain.upper()} ({code.severity}): {code.title}")
        for part in (code.meaning, code.consequence, code.action, f"Example: {code.example}"):
            click.echo(part)
        return
    if program is None:
        raise click.UsageError("name a PROGRAM to check")

    from postproc.report.terminal import show_findings
    from postproc.workflows.listing import check as run

    out = Out(json_to, quiet, verbose)
    with out.refusals(str(program), writes=page is not None):
        done = run(program, cell, config_dat, page)
        out.result(done.as_json())
    if dump and json_to != "-":
        click.echo("\n".join(done.toolpath.dump()))
    if not out.quiet:
        console = out.console()
        show_findings(console, done.findings)
        for line in done.summary():
            console.print(line, markup=False)
        if page is not None:
            click.echo(f"wrote {page}")
    raise SystemExit(done.exit)
