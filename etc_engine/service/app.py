"""The HTTP interface: what can be asked, and the errors as JSON."""

from __future__ import annotations

import asyncio
import json
import math
import sqlite3
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import asdict, dataclass, field
from importlib.resources import files
from typing import Annotated, Any, Literal

from fastapi import APIRouter, Depends, FastAPI, Query, Request
from fastapi.responses import FileResponse, Response
from pydantic import AfterValidator
from starlette.concurrency import run_in_threadpool
from starlette.exceptions import HTTPException

from etc_engine.durable.provenance import engine_version
from etc_engine.errors import InputError, OutputError, StudyError
from etc_engine.models import CATALOGUE
from etc_engine.models.catalogue import find_model
from etc_engine.models.records import evaluation, record
from etc_engine.packing import METHODS
from etc_engine.realization import ENGINES
from etc_engine.service.admission import SOURCE, apply, toml_of
from etc_engine.service.curve import plain
from etc_engine.service.guard import Guard
from etc_engine.service.held import EngineError
from etc_engine.service.live import LiveResults, log_tail
from etc_engine.service.messages import (
    About,
    Estimate,
    Id,
    Modelled,
    Solved,
    StudyList,
    StudyStatus,
    StudySummary,
    Submitted,
)
from etc_engine.service.queue import LOCKED_SECONDS, Entry, Queue, State
from etc_engine.service.reading import Finished
from etc_engine.service.refusals import (
    PARTICLES_BODY,
    REFUSALS,
    STUDY_BODY,
    add_refusals,
    distinct_keys,
    refuse_repeated_keys,
    refuse_unknown_query,
)
from etc_engine.service.running import Runner
from etc_engine.service.settings import Settings
from etc_engine.service.store import Store
from etc_engine.service.supervisor import damaged
from etc_engine.study.sweep import study_schema

PAGE = {
    "app.js": "text/javascript",
    "form.js": "text/javascript",
    "figure.js": "text/javascript",
    "style.css": "text/css",
    "icon.svg": "image/svg+xml",
}
REPORT_POLICY = "default-src 'none'; img-src data:; style-src 'unsafe-inline'; frame-ancestors 'none'; sandbox"
SHOWN_WORDS = (
    "equal:0.015",
    "uniform:0.01:0.02",
    "gaussian:0.015:0.002",
    "lognormal:0.015:0.002",
    "bidisperse:0.01:0.02:0.5",
)


@dataclass(frozen=True)
class Service:
    """What the requests work on."""

    settings: Settings
    store: Store
    queue: Queue
    live: LiveResults
    runner: Runner
    wake: Callable[[], None]
    _lock: threading.Lock = field(default_factory=threading.Lock)

    def spoil(self, study: str, error: OutputError) -> None:
        """The result of a study turned out to be damaged."""
        with self.changing():
            entry = self.queue.get(study)
            if entry is not None and entry.state == "done":
                self.queue.settle(study, "failed", damaged(error))
                self.store.set_aside(study)

    @contextmanager
    def changing(self) -> Iterator[None]:
        """One change of the queue and the folders at a time; see `Queue` for who else may hold it up."""
        if not self._lock.acquire(timeout=LOCKED_SECONDS):
            raise sqlite3.OperationalError("database is locked")
        try:
            yield
        finally:
            self._lock.release()


def _finite(value: float | None) -> float | None:
    if value is not None and not math.isfinite(value):
        raise ValueError(f"found {value}, expected a finite number")
    return value


Finite = Annotated[float | None, AfterValidator(_finite)]

api = APIRouter(prefix="/api", responses=REFUSALS, dependencies=[Depends(refuse_unknown_query)])
page = APIRouter(include_in_schema=False, dependencies=[Depends(refuse_unknown_query)])


def make_app(service: Service) -> Guard:
    """The application, behind its guard."""
    app = FastAPI(
        title="etc_engine",
        description="Effective thermal conductivity of particle systems: studies, single solves and models.",
        version=engine_version(),
        docs_url=None,
        redoc_url=None,
    )
    app.state.service = service
    app.include_router(page)
    app.include_router(api)
    add_refusals(app)
    return Guard(app, service.settings)


def _service(request: Request) -> Service:
    found: Service = request.app.state.service
    return found


def _entry(request: Request, study: str) -> Entry:
    entry = _service(request).queue.get(study)
    if entry is None:
        raise HTTPException(404, f"there is no study {study}")
    return entry


@api.get("/service")
def about(request: Request) -> About:
    """Version, launcher, limits and the words that a study can use."""
    service = _service(request)
    return About(
        engine=engine_version(),
        launcher=service.settings.launcher,
        ranks=service.settings.ranks,
        limits=asdict(service.settings.limits),
        queued=service.queue.count("queued"),
        running=service.queue.count("running"),
        packing_methods=list(METHODS),
        size_distributions=list(SHOWN_WORDS),
        engines={name: list(engine.methods) for name, engine in ENGINES.items() if engine.needs_contacts},
    )


@api.get("/schema")
def schema() -> dict[str, Any]:
    """The JSON schema of a study: every key with its type, default and meaning, and an example."""
    return study_schema()


@api.get("/studies")
async def list_studies(
    request: Request,
    state: State | None = None,
    limit: Annotated[int, Query(ge=1, le=10_000)] = 1000,
    offset: Annotated[int, Query(ge=0, le=10**9)] = 0,
) -> StudyList:
    """The queue, the newest studies first."""
    queue = _service(request).queue
    entries = queue.entries(state, limit, offset)
    summaries = [StudySummary.of(entry) for entry in entries]
    return StudyList.model_construct(studies=summaries, total=queue.count(state))


@api.post("/studies", status_code=201, openapi_extra=STUDY_BODY, responses={200: {"model": Submitted}})
async def submit_study(request: Request, response: Response) -> Submitted:
    """Hand in a study. The same study again is answered from the one that is there (200)."""
    text = await _study_text(request)
    entry, new = await run_in_threadpool(_submit, _service(request), text)
    response.status_code = 201 if new else 200
    return Submitted(**StudySummary.of(entry).model_dump(), new=new)


@api.post("/studies/check", openapi_extra=STUDY_BODY)
async def check_study(request: Request) -> Estimate:
    """Check a study and report its size, without running it."""
    service = _service(request)
    found = await run_in_threadpool(apply, await _study_text(request), service.settings.limits)
    return Estimate(
        id=found.id,
        name=found.study.name,
        known=service.queue.get(found.id) is not None,
        units=found.units,
        most=found.most,
        cells=found.cells,
        particles=found.particles,
        text=found.text,
    )


@api.get("/studies/{study}")
async def study_status(request: Request, study: Id) -> StudyStatus:
    """State, progress and the end of the log."""
    entry = _entry(request, study)
    tail = log_tail(_service(request).store.log(study))
    return StudyStatus.model_construct(**dict(StudySummary.of(entry)), log=tail)


@api.delete("/studies/{study}", status_code=204)
def remove_study(request: Request, study: Id) -> None:
    """Forget a study and all its files; one that runs has to be cancelled first."""
    service = _service(request)
    _entry(request, study)
    with service.changing():
        if not service.queue.remove(study):
            raise HTTPException(409, "the study is running: cancel it first")
        service.store.remove(study)
    service.live.forget(study)


@api.post("/studies/{study}/cancel")
def cancel_study(request: Request, study: Id) -> StudySummary:
    """End a study that waits or runs; what is finished is kept, and resume continues with it."""
    service = _service(request)
    entry = _entry(request, study)
    if not service.queue.cancel(study):
        raise HTTPException(409, f"the study is {entry.state}: only one that waits or runs can be cancelled")
    service.wake()
    return StudySummary.of(_entry(request, study))


@api.post("/studies/{study}/resume")
def resume_study(request: Request, study: Id) -> StudySummary:
    """Put a cancelled or failed study back in the queue; it continues where it stopped."""
    service = _service(request)
    entry = _entry(request, study)
    if not service.queue.resume(study):
        raise HTTPException(409, f"the study is {entry.state}: only one that was cancelled or failed can be resumed")
    service.wake()
    return StudySummary.of(_entry(request, study))


@api.head("/studies/{study}/study.toml", include_in_schema=False)
@api.get("/studies/{study}/study.toml", responses={200: {"content": {"text/plain": {}}}})
def study_text(request: Request, study: Id) -> Response:
    """The study as it was handed in."""
    _entry(request, study)
    return Response(_service(request).store.study_file(study).read_bytes(), media_type="text/plain; charset=utf-8")


@api.get("/studies/{study}/curve", responses={200: {"content": {"application/json": {}}}})
async def study_curve(request: Request, study: Id) -> Response:
    """Conductivity over the density, of one density over the temperature, with confidence intervals and models."""
    _entry(request, study)
    service = _service(request)
    if service.store.result(study).exists():
        return Response((await _finished(request, study)).curve, media_type="application/json")
    answer = service.live.fresh_curve(study) or await run_in_threadpool(service.live.growing_curve, study)
    return Response(answer, media_type="application/json")


@api.head("/studies/{study}/result.nc", include_in_schema=False)
@api.get("/studies/{study}/result.nc", response_class=FileResponse)
async def study_result(request: Request, study: Id) -> FileResponse:
    """The result as netCDF, read once before it is handed out."""
    await _require_result(request, study)
    path = _service(request).store.result(study)
    return FileResponse(path, media_type="application/x-netcdf", filename=f"{study}.nc")


@api.head("/studies/{study}/report.html", include_in_schema=False)
@api.get("/studies/{study}/report.html", response_class=FileResponse)
async def study_report(request: Request, study: Id) -> FileResponse:
    """The report as one HTML page; it is made when it is first asked for."""
    await _require_result(request, study)
    report = await run_in_threadpool(_service(request).runner.report, study)
    headers = {"content-security-policy": REPORT_POLICY}
    return FileResponse(report, media_type="text/html", filename=f"{study}.html", headers=headers)


@api.head("/studies/{study}/bed.png", include_in_schema=False)
@api.get("/studies/{study}/bed.png", response_class=FileResponse)
async def study_bed(request: Request, study: Id) -> FileResponse:
    """The packing of the first realization as a picture; it is drawn when it is first asked for."""
    await _require_result(request, study)
    picture = await run_in_threadpool(_service(request).runner.bed, study)
    return FileResponse(picture, media_type="image/png")


@api.post("/solve", openapi_extra=PARTICLES_BODY)
async def solve(
    request: Request,
    box: Annotated[
        str | None,
        Query(pattern="^[0-9eE+.,-]{1,99}$", description="edge lengths, for files without", examples=["1,1"]),
    ] = None,
    periodic: Annotated[str | None, Query(pattern="^[xyz]{0,3}$")] = None,
    frame: Annotated[int | None, Query(ge=-(10**9), le=10**9)] = None,
    engine: Annotated[str | None, Query(pattern="^[a-z]{1,20}$")] = None,
    method: Annotated[str | None, Query(pattern="^[a-z]{1,20}$", description="of the engine")] = None,
    modes: Annotated[int | None, Query(ge=1, le=30)] = None,
    contact_angle: Annotated[Finite, Query(description="half-angle in degrees of bonded contacts")] = None,
    bond_gap: Annotated[Finite, Query(description="largest bonded gap, in mean radii")] = None,
    conductivity: Annotated[Finite, Query(description="of the particles [W/(m K)]")] = None,
    contact_resistance: Annotated[Finite, Query(description="of a contact [m K/W]")] = None,
    area_resistance: Annotated[Finite, Query(description="of a unit of contact area [m2 K/W]")] = None,
) -> Solved:
    """Effective conductivity of the particles in the body; formats and options are those of ``etc-engine solve``."""
    given = {
        "box": box,
        "periodic": periodic,
        "frame": frame,
        "engine": engine,
        "method": method,
        "modes": modes,
        "contact-angle": contact_angle,
        "bond-gap": bond_gap,
        "conductivity": conductivity,
        "contact-resistance": contact_resistance,
        "area-resistance": area_resistance,
    }
    options = [f"--{name}={value}" for name, value in given.items() if value is not None]
    runner = _service(request).runner
    with runner.upload() as particles:
        with particles.open("wb") as file:
            async for block in request.stream():
                await run_in_threadpool(file.write, block)
        return Solved.model_validate(await run_in_threadpool(runner.solve, particles, options))


@api.get("/models")
def list_models() -> dict[str, list[dict[str, Any]]]:
    """The catalogue of conductivity models."""
    return {"models": [_plain_record(record(model)) for model in CATALOGUE.values()]}


@api.get("/models/{name}")
def describe_model(name: str) -> dict[str, Any]:
    """One model: inputs, validity, limits, reference."""
    return _plain_record(record(_model(name)))


@api.post("/models/{name}", dependencies=[Depends(refuse_repeated_keys)])
def evaluate_model(name: str, inputs: Modelled) -> dict[str, Any]:
    """The conductivity by a model; null where it is infinite."""
    phases = {"k1": inputs.k1, "k2": inputs.k2, "fraction": inputs.fraction}
    return _plain_record(evaluation(_model(name), phases, inputs.dimension, inputs.parameters))


@page.head("/")
@page.get("/")
def front_page() -> Response:
    """The web page."""
    return Response(files(__package__).joinpath("page/index.html").read_bytes(), media_type="text/html; charset=utf-8")


@page.head("/page/{name}")
@page.get("/page/{name}")
def page_file(name: Literal["app.js", "figure.js", "form.js", "style.css", "icon.svg"]) -> Response:
    """A part of the web page."""
    return Response(files(__package__).joinpath("page", name).read_bytes(), media_type=PAGE[name])


async def _require_result(request: Request, study: str) -> None:
    """Refuse a study that is not done, or whose result is damaged."""
    entry = _entry(request, study)
    if entry.state != "done":
        raise HTTPException(409, f"the study is {entry.state}: its result is there when it is done")
    await _finished(request, study)


async def _finished(request: Request, study: str) -> Finished:
    """Content of a result file; a study that was done and whose file is damaged becomes failed."""
    service = _service(request)
    try:
        return await asyncio.shield(asyncio.wrap_future(service.live.finished(study)))
    except EngineError:
        raise
    except OutputError as error:
        await run_in_threadpool(service.spoil, study, error)
        raise HTTPException(409, f"the study has failed: {damaged(error)}") from None


def _submit(service: Service, text: str) -> tuple[Entry, bool]:
    """Check a study, keep its text, put it in the queue: so that the queue never names a study without a text.

    One that was cancelled or has failed continues.
    """
    found = apply(text, service.settings.limits)
    with service.changing():
        known = service.queue.get(found.id)
        if known is None:
            service.store.save_study(found.id, text)
        elif known.state in ("cancelled", "failed"):
            service.queue.resume(found.id)
        entry, new = service.queue.submit(found.id, found.study.name, found.units, found.most)
    service.wake()
    return entry, new


async def _study_text(request: Request) -> str:
    """The body of a request as the text of a study file."""
    try:
        text = (await request.body()).decode("utf-8")
    except UnicodeDecodeError:
        raise StudyError(f"{SOURCE}: is not text in UTF-8") from None
    if "json" not in request.headers.get("content-type", ""):
        return text
    try:
        values = json.loads(text, object_pairs_hook=distinct_keys)
    except InputError as error:
        raise StudyError(f"{SOURCE}: {error}") from None
    except (ValueError, RecursionError) as error:
        raise StudyError(f"{SOURCE}: is not valid JSON: {error}") from None
    if not isinstance(values, dict):
        raise StudyError(f"{SOURCE}: expected a JSON object, found {type(values).__name__}")
    return toml_of(values)


def _model(name: str) -> Any:
    try:
        return find_model(name)
    except InputError as error:
        raise HTTPException(404, str(error)) from None


def _plain_record(values: Any) -> Any:
    if isinstance(values, dict):
        return {key: _plain_record(value) for key, value in values.items()}
    if isinstance(values, list):
        return [_plain_record(value) for value in values]
    return plain(values)
