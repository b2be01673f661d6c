"""The request of an operator: what a sentence asks for, in parts, and the sentences that are commands."""

from openbelief.request.commands import Command, command
from openbelief.request.parse import parse
from openbelief.request.request import Negation, Relation, Request, Which

__all__ = ["Command", "Negation", "Relation", "Request", "Which", "command", "parse"]
