"""``etc-engine report``: the result of a sweep as one HTML page."""

from __future__ import annotations

from pathlib import Path

import click

EXIT_BOUND_BROKEN = 3


@click.command("report")
@click.argument("results", nargs=-1, required=True, type=click.Path(path_type=Path), metavar="RESULT [RESULT ...]")
@click.option(
    "-o",
    "--output",
    required=True,
    type=click.Path(path_type=Path),
    help="HTML file to write. An existing page is replaced.",
)
def report_command(results: tuple[Path, ...], output: Path) -> int:
    """Write one self-contained page on the sweep in RESULT (netCDF).

    Figures, statistics, models, convergence, failures and provenance. Further results of the same study in boxes of
    other sizes show the convergence with system size. Exit status 3 if a rigorous bound is violated.
    """
    from etc_engine.cli.options import check_picture, check_place
    from etc_engine.comparison import (
        evaluate_models,
        fit_models,
        model_lines,
        running_statistics,
        samples,
        system_sizes,
    )
    from etc_engine.durable.files import replacing
    from etc_engine.errors import EtcError
    from etc_engine.output.report import report_page
    from etc_engine.sweep.packing import first_packing
    from etc_engine.sweep.result_file import open_dataset

    check_picture(output.with_suffix(".png"))
    check_place(output, *results)
    datasets = [open_dataset(path) for path in results]
    dataset = datasets[0]
    comparison, systems = evaluate_models(dataset), system_sizes(datasets)

    from etc_engine.output import figures

    drawn = {
        "comparison": figures.draw_comparison(comparison, model_lines(comparison)),
        "convergence": figures.draw_convergence(running_statistics(dataset)),
        "histograms": figures.draw_histograms(samples(dataset)),
    }
    absent = ""
    try:
        drawn["bed"] = figures.draw_bed(first_packing(dataset)[0])
    except EtcError as error:
        absent = str(error)
    over_temperature = figures.draw_over_temperature(comparison)
    if over_temperature is not None:
        drawn["temperature"] = over_temperature
    if len(datasets) > 1:
        drawn["systems"] = figures.draw_system_sizes(systems)
    pictures = {name: figures.png(figure) for name, figure in drawn.items()}
    page = report_page(dataset, comparison, fit_models(dataset), systems, pictures, absent)
    with replacing(output) as file:
        file.write_text(page, encoding="utf-8")
    click.echo(f"{output}: {len(page) / 1e6:.1f} MB, {len(pictures)} figures")
    return EXIT_BOUND_BROKEN if comparison.attrs["bound_broken"] else 0
