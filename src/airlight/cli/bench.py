"""`airlight bench`: timings on this adapter."""

import click

from airlight.cli.help import Command


@click.command(cls=Command)
@click.option("--json", "json_path", type=click.Path(), metavar="FILE", help="Also write the records as JSON.")
@click.option("-y", "--overwrite", is_flag=True, help="Replace the file if it exists.")
def bench(json_path: str | None, overwrite: bool) -> None:
    """Time the methods on this adapter."""
    if json_path is not None:
        from airlight.files import check_output

        check_output(json_path, overwrite=overwrite, image=False)
    from airlight.bench import run

    run(json_path=json_path, overwrite=overwrite)
