"""``etc-engine warm``: compile every kernel once, before the first command needs it."""

from __future__ import annotations

import time

import click


@click.command("warm")
@click.option(
    "--jobs", type=click.IntRange(min=1), help="Processes that compile. By default one for each processor core."
)
@click.option("--json", "as_json", is_flag=True, help="Print one JSON object.")
def warm_command(jobs: int | None, as_json: bool) -> None:
    """Compile all kernels now, on all cores, so that no later command waits for it.

    Run it once after an installation. Without it every command compiles what it needs at its first call.
    """
    from etc_engine.cli.options import print_json
    from etc_engine.cli.progress import PackingProgress
    from etc_engine.kernels import compile_all, cores, listed_kernels

    begin, count, compiled = time.perf_counter(), len(listed_kernels()), 0
    with PackingProgress("compiling kernels") as progress:
        for done, fresh in enumerate(compile_all(jobs or cores()), 1):
            compiled += fresh
            progress.report(done / count)
    seconds = time.perf_counter() - begin
    if as_json:
        print_json({"kernels": count, "compiled": compiled, "seconds": seconds})
    else:
        click.echo(f"{count} kernels ready, {compiled} compiled now, {seconds:.1f} s")
