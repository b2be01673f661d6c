"""What is put to a memory, as a ranking takes it: f_q, and the nodes that may answer."""

from __future__ import annotations

from typing import TypeAlias

import numpy as np

from openbelief.arrays import Array
from openbelief.embedding import TextSpace
from openbelief.node_table import NodeTable
from openbelief.phrase import is_background
from openbelief.request.encoded import EncodedRequest
from openbelief.request.request import Request
from openbelief.retrieval import Readout, RetrievalQuery
from openbelief.target_phrase import TargetPhrase, target_phrase

MemoryQuery: TypeAlias = str | EncodedRequest | Array  # a sentence, one that was embedded, a (d,) vector


def retrieval_query(query: MemoryQuery, readout: Readout, table: NodeTable, space: TextSpace) -> RetrievalQuery:
    """Raises ValueError on an empty sentence, one without an encoder, or a vector that is not of the space."""
    if isinstance(query, EncodedRequest):
        return RetrievalQuery(query.f_q, readout, _nodes_of(query.request, table))
    if isinstance(query, str):
        phrase = target_phrase(query)
        return RetrievalQuery(space.words([phrase.text])[0], readout, _nodes_of(phrase, table))
    return RetrievalQuery(space.vector(query), readout, _every(table))


def may_answer(query: MemoryQuery, table: NodeTable) -> Array:
    """(N,) bool, without the vector: the nodes that it ranks."""
    if isinstance(query, EncodedRequest):
        return _nodes_of(query.request, table)
    return _nodes_of(target_phrase(query), table) if isinstance(query, str) else _every(table)


def _nodes_of(phrase: Request | TargetPhrase, table: NodeTable) -> Array:
    """(N,) bool: the foreground, and the background where it is asked for by name."""
    thing = TargetPhrase(phrase.text).thing
    return _every(table) if is_background(thing) else ~table.background


def _every(table: NodeTable) -> Array:
    return np.ones(len(table), bool)
