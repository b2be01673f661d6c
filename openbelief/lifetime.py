"""What is opened and closed: construct, then `with`."""

from __future__ import annotations

from types import TracebackType
from typing import Self


class Lifetime:
    """`with x:` starts it, and closes it whatever happened in between. A constructor does no I/O."""

    def start(self) -> None:
        """Nothing, where being constructed is enough."""

    def close(self) -> None:
        raise NotImplementedError

    def __enter__(self) -> Self:
        self.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()
