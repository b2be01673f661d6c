"""The trials on the page: the list, one trial's scrubber, notes, export."""

from __future__ import annotations

import asyncio
import contextlib
import time
import zipfile
from collections.abc import AsyncIterator
from pathlib import Path
from tempfile import SpooledTemporaryFile

from starlette.requests import Request
from starlette.responses import JSONResponse, Response, StreamingResponse
from starlette.routing import Route

from logs.mcap_io.reader import LogError
from logs.trial.header import TrialError
from openbelief.store import BeliefFileError
from robot_app.console.live_pages import Handler, guarded
from robot_app.console.logins import Logins, body_of, refusal
from robot_app.console.open_trial import OpenTrial, opened
from robot_app.mission.trial_notes import add_note, notes_path, read_notes
from robot_app.mission.trial_shelf import TrialShelf

READ_EVERY_S = 1.0
READ_AT_ONCE = 4
BLOCK = 1 << 18
SPOOLED_BYTES = 32 << 20


class TrialPages:
    def __init__(self, shelf: TrialShelf) -> None:
        self._shelf = shelf

    def routes(self, logins: Logins) -> list[Route]:
        pages: dict[str, Handler] = {
            "/api/trials": self._list,
            "/api/trials/{name}": self._trial,
            "/api/trials/{name}/view/{step:int}": self._view,
            "/api/trials/{name}/frame/{stamp:int}.jpg": self._frame,
            "/api/trials/{name}/grid.png": self._grid,
            "/api/trials/{name}/export": self._export,
        }
        found = [Route(path, guarded(logins, handler)) for path, handler in pages.items()]
        return [*found, Route("/api/trials/{name}/notes", guarded(logins, self._note), methods=["POST"])]

    async def read(self) -> None:
        """Read new trials in the background, for as long as the server runs."""
        while True:
            left = await asyncio.to_thread(self._shelf.read_new, READ_AT_ONCE)
            await asyncio.sleep(0.0 if left else READ_EVERY_S)

    async def _list(self, _: Request) -> Response:
        return JSONResponse({"trials": await asyncio.to_thread(self._shelf.rows)})

    async def _trial(self, request: Request) -> Response:
        found = await self._open(request)
        if isinstance(found, Response):
            return found
        notes = await asyncio.to_thread(read_notes, found.path)
        return JSONResponse(await asyncio.to_thread(found.as_json) | {"notes": notes})

    async def _view(self, request: Request) -> Response:
        found = await self._open(request)
        if isinstance(found, Response):
            return found
        view = found.view_json(request.path_params["step"])
        return refusal(404, "There is no such step.") if view is None else Response(view, media_type="application/json")

    async def _frame(self, request: Request) -> Response:
        found = await self._open(request)
        if isinstance(found, Response):
            return found
        picture = await asyncio.to_thread(found.frame_jpeg, request.path_params["stamp"])
        return (
            refusal(404, "There is no such picture.") if picture is None else Response(picture, media_type="image/jpeg")
        )

    async def _grid(self, request: Request) -> Response:
        found = await self._open(request)
        if isinstance(found, Response):
            return found
        picture = await asyncio.to_thread(found.grid_png)
        return refusal(404, "It holds no map.") if picture is None else Response(picture, media_type="image/png")

    async def _note(self, request: Request) -> Response:
        path, text = self._path(request), (await body_of(request)).get("text")
        if path is None or not isinstance(text, str):
            return refusal(404, "There is no such trial.")
        if request.state.session.role != "operator":
            return refusal(403, "You are a viewer: notes are an operator's.")
        try:
            add_note(path, who=request.state.session.name, text=text, at_ms=time.time_ns() // 1_000_000)
        except (ValueError, OSError) as error:
            return refusal(400, str(error))
        return JSONResponse({"notes": read_notes(path)})

    async def _export(self, request: Request) -> Response:
        path = self._path(request)
        if path is None:
            return refusal(404, "There is no such trial.")
        archive = await asyncio.to_thread(_archive, path)
        headers = {"content-disposition": f'attachment; filename="{path.stem}.zip"'}
        return StreamingResponse(_blocks(archive), media_type="application/zip", headers=headers)

    def _path(self, request: Request) -> Path | None:
        return self._shelf.path(request.path_params["name"])

    async def _open(self, request: Request) -> OpenTrial | Response:
        path = self._path(request)
        if path is None:
            return refusal(404, "There is no such trial.")
        found = path.stat()
        try:
            return await asyncio.to_thread(opened, path, found.st_mtime_ns, found.st_size)
        except (LogError, TrialError, BeliefFileError, OSError) as error:
            return refusal(422, str(error))


def _archive(path: Path) -> SpooledTemporaryFile[bytes]:
    """The trial as it is, and its notes; both replay and read without this program's console."""
    spool: SpooledTemporaryFile[bytes] = SpooledTemporaryFile(max_size=SPOOLED_BYTES)  # noqa: SIM115 - _blocks closes
    with zipfile.ZipFile(spool, "w", zipfile.ZIP_STORED) as archive:
        for file in (path, notes_path(path)):
            if file.is_file():
                archive.write(file, file.name)
    spool.seek(0)
    return spool


async def _blocks(spool: SpooledTemporaryFile[bytes]) -> AsyncIterator[bytes]:
    with contextlib.closing(spool):
        while block := await asyncio.to_thread(spool.read, BLOCK):
            yield block
