"""The web page in a real browser: a study built, run and looked at from end to end."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from browser import ELEMENT, MISSING, Browser
from serving import STUDY, Service, ask, renamed, until

from etc_engine.service import client

pytestmark = [pytest.mark.skipif(bool(MISSING), reason=MISSING), pytest.mark.slow]

FITS = "return document.documentElement.scrollWidth <= innerWidth"
BANDS = "return [...document.querySelectorAll('path.band')].map(p => p.getBoundingClientRect().width)"
CONTROLS = "input, select, textarea, button, a, svg[role], progress"
UNNAMED = """return [...document.querySelectorAll(arguments[0])].filter(e => e.offsetParent !== null &&
    !(e.labels && e.labels.length) && !e.getAttribute('aria-label') && !e.innerText).map(e => e.outerHTML)"""
CONTRAST = """
const light = c => { const [r, g, b] = c.match(/[0-9.]+/g).slice(0, 3).map(v => (v /= 255) <= .03928 ? v / 12.92
    : ((v + .055) / 1.055) ** 2.4); return .2126 * r + .7152 * g + .0722 * b };
const behind = e => { for (; e; e = e.parentElement) { const c = getComputedStyle(e).backgroundColor;
    if (!/, 0\\)$|transparent/.test(c)) return c } return 'rgb(255, 255, 255)' };
return [...document.querySelectorAll('body *')].filter(e => e.offsetParent && [...e.childNodes].some(n =>
    n.nodeType === 3 && n.data.trim())).map(e => {
    const a = light(getComputedStyle(e).color), b = light(behind(e));
    return [(Math.max(a, b) + .05) / (Math.min(a, b) + .05), e.outerHTML.slice(0, 120)] }).filter(x => x[0] < 4.5)"""


@pytest.fixture(scope="module")
def slow(tmp_path_factory):
    """A service whose packings take a third of a second."""
    environment = {"ETC_TEST_SECONDS": "0.5"}
    with Service(tmp_path_factory.mktemp("page") / "data", slow=True, environment=environment) as running:
        yield running


@pytest.fixture(scope="module")
def browser(tmp_path_factory):
    with Browser(tmp_path_factory.mktemp("browser")) as running:
        yield running


def written(field: str) -> str:
    return f'[name="{field}"]'


def problem_beside(browser: Browser, field: str) -> str:
    return browser.until("return document.getElementById(arguments[0]).innerText", f"field-{field}-error")


def test_a_study_is_built_runs_and_grows_in_the_figure(slow, browser):
    browser.open(slow.url)
    browser.write(written("name"), "built")
    browser.write(written("packing.density"), "0.5, x")
    assert "found 'x'" in problem_beside(browser, "packing.density")
    assert browser.run("return document.querySelector('[aria-invalid]').name") == "packing.density"
    browser.write(written("packing.density"), "0.5, 0.6, 0.7")
    browser.write(written("packing.radii"), "uniform:0.2")
    assert "uniform" in problem_beside(browser, "packing.radii")
    browser.write(written("packing.radii"), "uniform:0.03:0.06")
    browser.write(written("statistics.realizations"), "5")
    browser.until("return document.getElementById('size').innerText.startsWith('15 packings, 30 results')")
    assert browser.run("return document.querySelectorAll('[aria-invalid]').length") == 0
    browser.click("#submit")
    browser.until("return location.hash.startsWith('#/study/')")
    first = browser.until(f"const w = (() => {{ {BANDS} }})(); return w.length ? w : null")
    assert browser.text("main .state") == "running"
    count = "/([0-9]+) (of|in all)/.exec(document.querySelector(s).innerText)[1]"
    told = f"return ['main p', 'figcaption'].map(s => {count})"
    for _ in range(10):  # one number above and below the figure at any moment
        above, below = browser.run(told)
        assert above == below
    assert 0 < browser.run("return document.querySelector('main progress').value") < 15
    browser.until("return document.querySelector('main .state').innerText === 'done'")
    browser.until(
        "return document.querySelector('figcaption').innerText.startsWith('Each point: mean over 5 packings (15')"
    )
    last = browser.run(BANDS)
    assert len(last) == 2
    assert sum(last) > sum(first)  # bands over all three densities at the end, over those with two realizations before
    assert browser.run("return document.querySelectorAll('tbody tr').length") >= 3 + 2  # values and models
    study = browser.run("return location.hash.split('/')[2]")
    dataset = client.fetch(slow.server, study)
    shown = browser.run("return document.querySelector('details table tbody td').textContent")
    mean = float(dataset.conductivity.isel(density=0, contact_angle=0).values.diagonal(0, 1, 2).mean())
    assert float(shown.split()[0]) == pytest.approx(mean, rel=1e-3)
    links = browser.run("return [...document.querySelectorAll('a.button')].map(a => a.href)")
    assert [link.rsplit("/", 1)[1] for link in links] == ["result.nc", "report.html", "study.toml"]
    assert all(ask(link)[0] == 200 for link in links if "report" not in link)
    assert browser.complaints() == []


def test_the_page_shows_the_packing_when_it_is_opened(tmp_path, browser):
    pytest.importorskip("matplotlib")
    with Service(tmp_path / "data") as real:
        study = client.submit(real.server, STUDY)["id"]
        client.wait(real.server, study, interval=0.1)
        browser.open(real.url)
        browser.run("location.hash = '#/study/' + arguments[0]", study)
        packing = "[...document.querySelectorAll('details')].find(d => d.textContent.startsWith('Packing'))"
        browser.until(f"return {packing} && !{packing}.hidden")
        browser.run(f"{packing}.open = true")
        browser.until(f"const image = {packing}.querySelector('img'); return image && image.naturalWidth > 300")
        assert browser.complaints() == []


@pytest.mark.parametrize(("width", "scheme"), [(1280, "light"), (420, "dark")])
def test_nothing_hangs_over_and_everything_has_a_name(slow, browser, width, scheme):
    """Also read by whoever does not see it: names of controls, and contrast of 4.5 (WCAG AA)."""
    study = client.submit(slow.server, STUDY)["id"]
    client.wait(slow.server, study, interval=0.1)
    browser.resize(width, 900)
    browser.prefer(scheme)
    browser.open(slow.url)
    for part, sign in (("new", "#submit"), (f"study/{study}", "path.band"), ("solve", "#file"), ("models", "#model")):
        browser.run("location.hash = '#/' + arguments[0]", part)
        browser.find(sign)
        browser.run("document.querySelectorAll('details').forEach(d => d.open = true)")
        assert browser.run(FITS), part
        assert browser.run(UNNAMED, CONTROLS) == [], part
        assert browser.run(CONTRAST) == [], part
    browser.resize(1280, 900)
    browser.prefer("light")


def test_the_form_follows_the_engine(slow, browser):
    """An engine of the whole cell has no contacts; what has no meaning is neither shown nor sent."""
    shown = "return [...document.querySelectorAll('.field')].filter(f => f.offsetParent).map(f => f.dataset.field)"
    choose = "arguments[0].value = arguments[1]; arguments[0].dispatchEvent(new Event('input', {bubbles: true}))"
    browser.open("about:blank")
    browser.open(slow.url)
    assert "contacts.contact_angle" in browser.until(shown)
    for field, word in (("packing.method", "lubachevsky-stillinger"), ("conduction.engine", "voxel")):
        browser.run(choose, {ELEMENT: browser.find(written(field))}, word)
    fields = browser.run(shown)
    assert {"pores.conductivity", "conduction.resolution"} <= set(fields)
    assert not any(field.startswith("contacts.") or field == "conduction.particles" for field in fields)
    browser.write(written("particles.conductivity"), "10")
    browser.write(written("pores.conductivity"), "1")
    browser.write(written("packing.periodic"), "xy")
    browser.write(written("packing.radii"), "equal:0.05")
    browser.write(written("packing.density"), "0.2, 0.3")
    browser.write(written("models.names"), "maxwell")
    browser.write(written("conduction.resolution"), "2")
    assert "at least" in problem_beside(browser, "conduction.resolution")
    browser.write(written("conduction.resolution"), "40")
    browser.until("return document.getElementById('size').innerText.startsWith('40 packings, 40 results')")


def test_the_form_takes_a_bed_between_walls_of_two_temperatures(slow, browser):
    """The difference of the walls is asked for with nonlinear = true only, and that with the method that takes it."""
    pytest.importorskip("CoolProp")
    shown = "return [...document.querySelectorAll('.field')].filter(f => f.offsetParent).map(f => f.dataset.field)"
    choose = "arguments[0].value = arguments[1]; arguments[0].dispatchEvent(new Event('input', {bubbles: true}))"
    browser.open("about:blank")
    browser.open(slow.url)
    browser.until(shown)
    chosen = {"packing.method": "lubachevsky-stillinger", "contacts.rule": "overlap"}
    for field, word in chosen.items():
        browser.run(choose, {ELEMENT: browser.find(written(field))}, word)
    assert "conduction.nonlinear" not in browser.run(shown)
    browser.write(written("conduction.method"), "facets")
    assert "conduction.temperature_difference" not in browser.run(shown)
    browser.run(choose, {ELEMENT: browser.find(written("conduction.nonlinear"))}, "true")
    assert "conduction.temperature_difference" in browser.run(shown)
    values = {
        "packing.radii": "equal",
        "packing.count": "8",
        "packing.box": "2e-3, 2e-3, 4e-3",
        "packing.periodic": "xy",
        "packing.density": "0.4",
        "particles.material": "alumina",
        "pores.gas": "helium",
        "pores.pressure": "1e5",
        "radiation.emissivity": "0.8",
        "models.names": "maxwell",
        "statistics.realizations": "2",
        "conduction.temperature": "600",
    }
    for field, word in values.items():
        browser.write(written(field), word)
    assert "missing" in problem_beside(browser, "conduction.temperature_difference")
    browser.write(written("conduction.temperature_difference"), "100, 300")
    browser.until("return document.getElementById('size').innerText.startsWith('2 packings, 4 results')")


def test_a_pasted_study_is_refused_then_taken_and_cancelled(slow, browser):
    browser.open(slow.url)
    browser.click("#tab-text")
    assert 'radii = "uniform:0.01:0.02"' in browser.run("return document.getElementById('study-text').value")
    paste = "const t = arguments[1]; t.value = arguments[0]; t.dispatchEvent(new Event('input'))"
    area = {ELEMENT: browser.find("#study-text")}
    text = renamed("pasted <b>bold</b>").replace("realizations = 3", "realizations = 40")
    browser.run(paste, text.replace("[packing]", "[packin]"), area)
    assert "did you mean 'packing'" in browser.until("return document.getElementById('study-error').innerText")
    browser.run(paste, text, area)
    browser.until("return document.getElementById('size').innerText.startsWith('80 packings')")
    browser.click("#submit")
    browser.until("return document.querySelector('main .state')?.innerText === 'running'")
    assert browser.text("h1") == "pasted <b>bold</b>"
    browser.run("[...document.querySelectorAll('main button')].find(b => b.innerText === 'Cancel').click()")
    browser.until("return document.querySelector('main .state').innerText === 'cancelled'")
    assert browser.run("return [...document.querySelectorAll('main button')].map(b => b.innerText)") == [
        "Resume",
        "Remove",
    ]
    assert browser.complaints() == []


DRAW = """const found = figure(arguments[0], new Set(arguments[1]), 900);
return [found.legend.map(entry => entry[0]),
    [...found.svg.querySelectorAll('text[text-anchor=end]')].map(t => +t.textContent)]"""


def test_drawn_models_are_in_the_picture_or_have_an_arrow_with_their_value(slow, browser):
    browser.open(slow.url)
    flat = {
        "low": [0.9, 1.9],
        "high": [1.1, 2.1],
        "count": [3, 3],
        "name": "5°",
    }
    models = [
        {"name": name, "title": name, "at": [0.5, 0.6], "curves": [values]}
        for name, values in (
            ("near", [3.0, 4.0]),
            ("far", [90.0, 99.0]),
            ("steep", [1.5, 50.0]),
            ("falling", [-70.0, 1.5]),
            ("hidden", [0.5, 0.6]),
        )
    ]
    along = {"title": "density", "values": [0.5, 0.6]}
    curve = {"confidence": 0.95, "along": along, "series": [{"mean": [1.0, 2.0], **flat}], "models": models}
    series = "5°"
    assert browser.run(DRAW, curve, [])[0] == [series]
    assert max(browser.run(DRAW, curve, [])[1]) < 3
    legend, ticks = browser.run(DRAW, curve, ["near", "far", "steep", "falling"])
    assert legend == [series, "near", "far \u2191 99", "steep \u2191 50", "falling \u2193 -70"]
    assert 4 <= max(ticks) < 5


def test_the_queue_tells_failed_cells_and_cuts_names(slow, browser):
    browser.open(slow.url)
    assert browser.run("return [0, 1, 4].map(n => failedOf({ failed_cells: n }))") == [
        "",
        " (1 cell failed)",
        " (4 cells failed)",
    ]
    assert browser.run("return clean(arguments[0])", "a\x1b\u202eb") == r"a\u{1b}\u{202e}b"
    assert browser.run("return clean(arguments[0])", "x" * 500) == "x" * 59 + "…"


def written_dump(path: Path) -> Path:
    head = "ITEM: TIMESTEP\n0\nITEM: NUMBER OF ATOMS\n2\nITEM: BOX BOUNDS ff ff pp\n0 1\n0 1\n-0.5 0.5\n"
    path.write_text(head + "ITEM: ATOMS id x y z radius\n1 0.25 0.5 0 0.26\n2 0.75 0.5 0 0.26\n")
    return path


def test_a_single_solve_and_a_model(slow, browser, tmp_path):
    (tmp_path / "disks.csv").write_text("x,y,radius\n0.25,0.5,0.26\n0.75,0.5,0.26\n")
    browser.open(slow.url + "/#/solve")
    browser.choose_file("#file", tmp_path / "disks.csv")
    assert browser.run("return document.getElementById('box').value") == ""
    browser.write("#box", "1,1")
    browser.click("main button.main")
    shown = browser.until("return document.querySelector('dd')?.innerText")
    expected = client.solve(slow.server, (tmp_path / "disks.csv").read_bytes(), box="1,1")["conductivity"]
    assert float(shown) == pytest.approx(expected, rel=1e-7)
    choose = "arguments[0].value = arguments[1]; arguments[0].dispatchEvent(new Event('change', {bubbles: true}))"
    for field, word in (("#engine", "pipe"), ("#method", "uniform")):
        browser.run(choose, {ELEMENT: browser.find(field)}, word)
    browser.click("main button.main")
    pipe = {"box": "1,1", "engine": "pipe", "method": "uniform"}
    expected = client.solve(slow.server, (tmp_path / "disks.csv").read_bytes(), **pipe)["conductivity"]
    shown = browser.until(
        "const d = document.querySelector('dd')?.innerText; return d === arguments[0] ? null : d", shown
    )
    assert float(shown) == pytest.approx(expected, rel=1e-7)
    browser.choose_file("#file", written_dump(tmp_path / "disks.dump"))
    browser.run(choose, {ELEMENT: browser.find("#engine")}, "dtem")
    browser.write("#box", "")
    browser.click("main button.main")
    browser.until("const d = document.querySelector('dd')?.innerText; return d && d !== arguments[0]", shown)
    noted = browser.run("return document.querySelector('main p.error').innerText")
    assert "taken for disks" in noted  # all heights of the dump are 0
    browser.run("location.hash = '#/models'")
    browser.find("#model")
    browser.run("const m = document.getElementById('model'); m.value = 'maxwell'; m.dispatchEvent(new Event('change'))")
    for name, value in (("k1", "1"), ("k2", "10"), ("fraction", "2")):
        browser.write(f"#in-{name}", value)
    browser.click("main button.main")
    assert "must lie in [0, 1]" in browser.until("return document.querySelector('main p.error')?.innerText")
    browser.write("#in-fraction", "0.3")
    browser.click("main button.main")
    browser.until("return document.querySelector('form .buttons p').innerText === '1.650602410 W/(m K)'")
    assert browser.complaints() == []


def test_the_page_asks_for_the_token_and_keeps_it_out_of_every_address(tmp_path, browser):
    token = "a-word-nobody-guesses"
    with Service(tmp_path / "data", {"token": token}, slow=True) as service:
        study = client.submit(service.server, STUDY)["id"]
        client.wait(service.server, study, interval=0.1)
        browser.open(service.url)
        browser.until("return !document.getElementById('token').hidden")
        browser.write("#token-word", "a-wrong-word-of-some-length")
        browser.click("#token button")
        browser.until("return document.getElementById('token-label').innerText.startsWith('The token is wrong')")
        browser.write("#token-word", token)
        browser.click("#token button")
        browser.find("#queue a")
        browser.run("location.hash = '#/study/' + arguments[0]", study)
        browser.find("path.band")
        addresses = browser.run("return [location.href, ...performance.getEntries().map(e => e.name)]")
        assert any("/curve" in address for address in addresses)
        assert token not in json.dumps(addresses)
        assert token not in browser.run("return document.documentElement.outerHTML")
        browser.run("[...document.querySelectorAll('main button')].find(b => b.innerText.startsWith('Study')).click()")
        assert browser.text("#alarm") == ""
        assert token not in service.said()


def test_the_page_goes_on_when_the_service_comes_back(tmp_path, browser):
    service = Service(tmp_path / "data", slow=True)
    with service:
        port = int(service.url.rsplit(":", 1)[1])
        browser.open(service.url)
        browser.find("#submit")
    browser.until("return document.getElementById('alarm').innerText.includes('does not answer')")
    with Service(tmp_path / "data", {"port": port}, slow=True) as again:
        client.submit(again.server, STUDY)
        browser.until("return document.querySelector('#queue a') && document.getElementById('alarm').hidden")
        until(lambda: browser.text("#queue .state") == "done")
