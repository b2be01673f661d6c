"""What the live page asks for besides its snapshots: site, map, an object's evidence, the judged picture, STOP."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable

from starlette.requests import Request
from starlette.responses import JSONResponse, Response
from starlette.routing import Route

from behaviors.safety_policy import SafetyPolicy
from drivers.ports import Map, PortError
from openbelief.memory import ObjectMemory
from robot_app.console.commands import HOW
from robot_app.console.evidence import best_crop, evidence_json
from robot_app.console.logins import Logins, refusal
from robot_app.console.site_plan import grid_json, grid_png, site_json
from robot_app.console.snapshots import LiveMission
from robot_app.mission.operator import SharedOperator

Handler = Callable[[Request], Awaitable[Response]]


def guarded(logins: Logins, handler: Handler) -> Callable[[Request], Awaitable[Response]]:
    """The handler, for who is logged in."""

    async def guard(request: Request) -> Response:
        request.state.session = logins.session(request)
        return refusal(401, "Log in first.") if request.state.session is None else await handler(request)

    return guard


class LivePages:
    def __init__(
        self, operator: SharedOperator, memory: ObjectMemory, safety: SafetyPolicy, grid: Map, live: LiveMission
    ) -> None:
        self._operator, self._memory, self._safety, self._grid, self._live = operator, memory, safety, grid, live

    def routes(self, logins: Logins) -> list[Route]:
        pages: dict[str, Handler] = {
            "/api/site": self._site,
            "/api/grid": self._grid_json,
            "/api/grid.png": self._grid_png,
            "/api/objects/{id:int}": self._object,
            "/api/objects/{id:int}/crop.jpg": self._crop,
            "/api/looks/{stamp:int}.jpg": self._look,
        }
        found = [Route(path, guarded(logins, handler)) for path, handler in pages.items()]
        return [*found, Route("/api/stop", guarded(logins, self._stop), methods=["POST"])]

    async def _stop(self, request: Request) -> Response:
        """Another way for STOP, where the page's socket is down."""
        self._operator.stop(
            because=f"{request.state.session.name} pressed STOP", who=request.state.session.name, how=HOW
        )
        return JSONResponse({"ok": True})

    async def _site(self, _: Request) -> Response:
        return JSONResponse(await asyncio.to_thread(site_json, self._memory, self._safety))

    async def _grid_json(self, _: Request) -> Response:
        try:
            return JSONResponse(grid_json(self._grid.latest()))
        except PortError as error:
            return refusal(503, str(error))

    async def _grid_png(self, _: Request) -> Response:
        try:
            return Response(await asyncio.to_thread(grid_png, self._grid.latest()), media_type="image/png")
        except PortError as error:
            return refusal(503, str(error))

    async def _object(self, request: Request) -> Response:
        object_id = request.path_params["id"]
        if object_id >= len(self._memory.objects):
            return refusal(404, f"There is no object {object_id}.")
        return JSONResponse(evidence_json(self._memory, object_id))

    async def _crop(self, request: Request) -> Response:
        object_id = request.path_params["id"]
        crop = best_crop(self._memory.objects[object_id]) if object_id < len(self._memory.objects) else None
        return refusal(404, "No crop was kept of it.") if crop is None else _jpeg(crop)

    async def _look(self, request: Request) -> Response:
        picture = await asyncio.to_thread(self._live.frame_jpeg, request.path_params["stamp"])
        return refusal(404, "There is no such look.") if picture is None else _jpeg(picture)


def _jpeg(picture: bytes) -> Response:
    return Response(picture, media_type="image/jpeg")
