"""`airlight bench`: timings on this adapter."""

import click

from airlight.cli.help import Command


@click.command(cls=Command)
@click.option("--json", "json_path", type=click.Path(), metavar="FILE", help="Also write the records as JSON.")
@click.option("-y", "--overwrite", is_flag=True, help="Replace the file if it exists.")
@click.option("--quick", is_flag=True, help="A part of it, with fewer runs: less than a minute on two cores.")
def bench(json_path: str | None, overwrite: bool, quick: bool) -> None:
    """Time the methods on this adapter: a quarter of an hour on two cores."""
    if json_path is not None:
        from airlight.files import check_output

        check_output(json_path, overwrite=overwrite, image=False)
    from airlight.bench import run

    run(json_path=json_path, overwrite=overwrite, is_quick=quick)
