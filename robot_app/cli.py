"""`openbelief VERB`: one table of verbs; only the verb that was asked for is imported, so help answers at once."""

from __future__ import annotations

import argparse
import errno
import importlib
import json
import os
import shutil
import sys
import textwrap
from collections.abc import Iterator
from typing import Any, NoReturn

VERBS = {
    "demo": "the whole loop in simulation, then its replay",
    "record": "record a walk from the configured sources",
    "map": "build a memory from a recording",
    "query": "rank the objects of a memory for a phrase, with the evidence",
    "why": "every phrase, weight, frame and mask behind an object",
    "inspect": "floors, rooms, views and objects of a memory; a plan and a page of them",
    "rebuild": "new belief parameters over the same evidence",
    "run": "live: missions from a configuration",
    "ask": "one mission, from the terminal",
    "mcp": "for language-model agents; motion stays a person's",
    "onboard": "on the robot: the watchdog, and sensors as ROS topics",
    "replay": "re-run a trial's decisions without a robot",
    "trials": "list recorded trials and their outcomes",
    "recover": "rewrite what a truncated recording still holds",
    "eval": "score a memory against ground truth",
    "doctor": "is everything in place? each part ok, warn or fail, with the remedy",
    "accounts": "who may use the console",
    "certs": "keys, certificates and Zenoh configurations of a robot's network",
    "models": "networks: list, pull, export, check",
    "bench": "measure this machine under a part's full load",
}
DISK_FULL = {errno.ENOSPC, errno.EDQUOT, errno.EFBIG}  # such an error names no file


class Failure(Exception):
    """A failure with a name: one clear line for the user, exit status 1."""


class Usage(Failure):
    """A command line that asks for what does not go together, exit status 2."""


def shown(sentence: str) -> str:
    """A sentence that may quote a file, a wire or an operator: nothing in it moves the cursor or forges a line."""
    from logs.structured import neutralise

    return neutralise(sentence)


class Parser(argparse.ArgumentParser):
    def error(self, message: str) -> NoReturn:
        self.exit(2, f"openbelief: {shown(message)}{shown(_quotes(self.prog, message))}\nTry '{self.prog} --help'.\n")


def _quotes(program: str, message: str) -> str:
    """Loose words where a sentence belongs are nearly always one without its quotes."""
    head, _, words = message.partition("unrecognized arguments: ")
    asked = program in ("openbelief query", "openbelief ask")
    loose = asked and not head and words and not any(word.startswith("-") for word in words.split())
    return '. A sentence of several words goes in quotes: "take me to the chair".' if loose else ""


def _fitting(text: str) -> str:
    """Paragraphs as wide as argparse makes the rest of its help; lines that are indented stay as they are."""
    width = shutil.get_terminal_size().columns - 2
    paragraphs = text.split("\n\n")
    return "\n\n".join(each if "\n " in each else textwrap.fill(each, width) for each in paragraphs)


def build_parser(verb: str | None) -> Parser:
    """The parser of one verb, or of the table of verbs where none (or no known one) is named."""
    if verb in VERBS:
        module = importlib.import_module(f"robot_app.verbs.{verb}")
        parser = Parser(
            prog=f"openbelief {verb}",
            description=_fitting((module.__doc__ or VERBS[verb]).strip()),
            epilog=f"example:\n  {module.EXAMPLE}",
            formatter_class=argparse.RawDescriptionHelpFormatter,
        )
        parser.add_argument("--json", action="store_true", help="machine-readable result on stdout, logs on stderr")
        module.add_arguments(parser)
        parser.set_defaults(run=module.run)
        return parser
    parser = Parser(
        prog="openbelief",
        description="Language-guided navigation for real robots.",
        epilog="verbs:\n"
        + "\n".join(f"  {name:<10}{summary}" for name, summary in VERBS.items())
        + "\n\nexample:\n  openbelief demo --out demo-out",
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--version", action="store_true", help="print the version and exit")
    parser.add_argument(
        "verb", nargs="?", choices=VERBS, metavar="VERB", help="one of the verbs below; VERB --help says more"
    )
    return parser


def print_json(result: Any) -> None:
    """The verb's one machine-readable result, on stdout."""
    json.dump(result, sys.stdout, allow_nan=False)
    sys.stdout.write("\n")


def main(argv: list[str] | None = None) -> int:
    os.environ.setdefault(
        "OPENBLAS_NUM_THREADS", "1"
    )  # before numpy: our matrices are small, waiting threads cost 30 %
    arguments = list(sys.argv[1:] if argv is None else argv)
    verb = arguments[0] if arguments else None
    try:
        return _run(verb, arguments)
    except (Exception, KeyboardInterrupt) as error:  # noqa: BLE001 - a defect is raised again
        return _ended(error, verb, arguments)


def _run(verb: str | None, arguments: list[str]) -> int:
    parser = build_parser(verb)
    if verb in VERBS:
        options = parser.parse_args(arguments[1:])
        try:
            return int(options.run(options) or 0)
        except Usage as usage:
            parser.error(str(usage))
    options = parser.parse_args(arguments)
    if options.version:
        from importlib.metadata import version

        print(f"openbelief {version('openbelief')}")
    else:
        parser.print_help()
    return 0 if options.version or not arguments else 2


def _ended(error: BaseException, verb: str | None, arguments: list[str]) -> int:
    """The exit status for what ended a verb, said in one line; a defect is raised again.

    Ctrl-C while a module is imported comes out of it as an ImportError (open3d) or a RuntimeError (a class body's):
    what began as Ctrl-C is one.
    """
    name = f"openbelief {verb}" if verb in VERBS else "openbelief"
    if any(isinstance(each, KeyboardInterrupt) for each in _origins(error)):
        print(f"{name}: stopped by the user", file=sys.stderr)
        return 130
    if isinstance(error, Failure) or _is_of_a_memory(error):
        print(f"{name}: {shown(str(error))}", file=sys.stderr)
        return 1
    if isinstance(error, BrokenPipeError):
        return 1
    if isinstance(error, OSError) and _was_named(error.filename, arguments):
        print(f"{name}: {shown(str(error.filename))}: {error.strerror}.", file=sys.stderr)
        return 1
    if isinstance(error, OSError) and error.errno in DISK_FULL:
        print(f"{name}: what it was to write is not written: {error.strerror}.", file=sys.stderr)
        return 1
    raise error


def _is_of_a_memory(error: BaseException) -> bool:
    """Whether a .belief file was refused, maybe long after it was opened: what is read of it is checked when it is."""
    checks = sys.modules.get("openbelief.file_checks")
    return checks is not None and isinstance(error, checks.BeliefFileError)


def _was_named(path: object, arguments: list[str]) -> bool:
    """Whether a path is one that the command line names, or lies below one: an OSError on it is no defect."""
    name = str(path or "")
    return bool(name) and any(argument and (argument in name or name in argument) for argument in arguments[1:])


def _origins(error: BaseException | None) -> Iterator[BaseException]:
    """The error, and what it came from."""
    while error is not None:
        yield error
        error = error.__cause__ or error.__context__


if __name__ == "__main__":
    from robot_app import cli  # verbs raise that module's Failure, which is not __main__'s

    sys.exit(cli.main())
