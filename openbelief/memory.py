"""ObjectMemory: the frozen graph of objects that tasks read (paper: B_i, eq. node-state)."""

from __future__ import annotations

import hashlib
import os
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from numbers import Integral
from typing import Any

import numpy as np

from openbelief import saved_file
from openbelief.arrays import Array
from openbelief.association import ExtentAlarm, associate, extent_alarms
from openbelief.belief import Concept
from openbelief.belief_file import BeliefFile
from openbelief.embedding import TextSpace, embed_phrases
from openbelief.evidence import Evidence, FrameRecord, canonical_order
from openbelief.grounded.answer import Answer, answer, ranked
from openbelief.grounded.geometry import Viewer
from openbelief.grounded.options import GroundedOptions
from openbelief.grounded.reader import GroundedReader
from openbelief.grounded.table import map_table
from openbelief.memory_query import MemoryQuery, may_answer, retrieval_query
from openbelief.node import ObjectNode
from openbelief.node_columns import believe
from openbelief.node_table import NodeTable
from openbelief.observation import Observation
from openbelief.parameters import ACQUISITION, Parameters
from openbelief.perception.ports import TextEncoder
from openbelief.projection import check_projection, project_language, project_node
from openbelief.request import Request, parse
from openbelief.request.encoded import EncodedRequest
from openbelief.retrieval import Candidate, NodeScores, check_readout
from openbelief.rooms import Room
from openbelief.surroundings import Surroundings
from openbelief.target_phrase import target_phrase

__all__ = ["Candidate", "Concept", "ObjectMemory", "ObjectNode"]


@dataclass(frozen=True, eq=False)
class ObjectMemory:
    """Make one with `build` or `open`. Nothing in it can be changed; belief follows from the evidence.

    table: all nodes in columns; `objects` are its rows. text_encoder: None where only vectors can be asked.
    """

    table: NodeTable = field(repr=False)
    text_encoder: TextEncoder | None = field(repr=False, default=None)

    @classmethod
    def build(
        cls,
        observations: Iterable[Observation],
        text_encoder: TextEncoder,
        parameters: Parameters | None = None,
        *,
        feature_text_aligned: bool = True,
        frames: Iterable[FrameRecord] = (),
        about: Mapping[str, Any] | None = None,
        rooms: Iterable[Room] = (),
        surroundings: Surroundings | None = None,
    ) -> ObjectMemory:
        """Associate, then believe. Object ids are ranks by each object's smallest (recording, frame, mask).

        feature_text_aligned: False where features cannot be compared with text (they may then have another length).
        Raises ValueError on features of unlike length or an encoder that breaks its word.
        """
        given, parameters = list(observations), parameters or Parameters()
        order, digests = canonical_order(given)
        ordered = [given[i] for i in order]
        _check_features(ordered, text_encoder.dim if feature_text_aligned else None)
        evidence = Evidence(
            observations=ordered,
            digests=digests,
            partition=associate(ordered, parameters),
            embeddings=embed_phrases(ordered, text_encoder),
            frames=tuple(sorted(frames)) or _frames_of(ordered),
            rooms=tuple(rooms),
            about=about or {},
            read_surroundings=lambda: surroundings or Surroundings(),
            parameters=parameters,
            text_encoder_id=text_encoder.id,
            text_dim=int(text_encoder.dim),
            feature_text_aligned=feature_text_aligned,
        )
        return cls.of(evidence, text_encoder)

    @classmethod
    def open(cls, path: str | os.PathLike[str], text_encoder: TextEncoder | None = None) -> ObjectMemory:
        """A finished .belief file; without an encoder only vectors can be asked.

        Raises BeliefFileError where the file cannot be used, ValueError where the encoder is not the file's.
        """
        file = BeliefFile(path)
        evidence = file.evidence()
        memory = cls(NodeTable(evidence, file.node_columns(evidence)))
        return memory if text_encoder is None else memory.with_text_encoder(text_encoder)

    @classmethod
    def of(cls, evidence: Evidence, text_encoder: TextEncoder | None = None) -> ObjectMemory:
        """The memory that follows from evidence: the same evidence, partition and parameters give the same."""
        return cls(NodeTable(evidence, believe(evidence)), text_encoder)

    @property
    def evidence(self) -> Evidence:
        return self.table.evidence

    @cached_property
    def objects(self) -> tuple[ObjectNode, ...]:
        """B_i; object i has id i."""
        return tuple(ObjectNode(self.table, i) for i in range(len(self.table)))

    @property
    def parameters(self) -> Parameters:
        return self.evidence.parameters

    @property
    def text_encoder_id(self) -> str:
        return self.evidence.text_encoder_id

    @property
    def text_dim(self) -> int:
        return self.evidence.text_dim

    @property
    def feature_text_aligned(self) -> bool:
        return self.evidence.feature_text_aligned

    @property
    def content_hash(self) -> str:
        """Names the evidence, its partition, the encoder and the parameters."""
        return self.evidence.content_hash

    @property
    def state_hash(self) -> str:
        """Names the content and the rooms, given and derived: what a trial and an operator's question are about."""
        return self.evidence.state_hash

    def fingerprint(self) -> str:
        """Hex sha256 of all that is in memory as it is now: of what answers, nothing may change during a mission."""
        said = self.evidence.state_again().encode() + self.table.digest()
        return hashlib.sha256(said).hexdigest()

    @property
    def observations(self) -> Sequence[Observation]:
        """All evidence, in canonical order."""
        return self.evidence.observations

    @property
    def embeddings(self) -> Mapping[str, Array]:
        """Every comparable phrase -> (d,) float32 unit length."""
        return self.evidence.embeddings

    @property
    def frames(self) -> tuple[FrameRecord, ...]:
        return self.evidence.frames

    @property
    def about(self) -> Mapping[str, Any]:
        return self.evidence.about

    @property
    def rooms(self) -> tuple[Room, ...]:
        return self.evidence.rooms

    @property
    def surroundings(self) -> Surroundings:
        return self.evidence.surroundings

    def with_text_encoder(self, text_encoder: TextEncoder) -> ObjectMemory:
        """The same memory, able to hear sentences. Raises ValueError on another id or dim than the stored one."""
        if text_encoder.id != self.text_encoder_id or text_encoder.dim != self.text_dim:
            raise ValueError(
                f"This memory speaks {self.text_encoder_id!r} ({self.text_dim} numbers), the encoder given is "
                f"{text_encoder.id!r} ({text_encoder.dim}): open it with its own, or map again."
            )
        return replace(self, text_encoder=text_encoder)

    def with_rooms(self, rooms: Iterable[Room]) -> ObjectMemory:
        """The same memory, of the same content hash, whose objects stand in these rooms."""
        return self._with(rooms=tuple(rooms))

    def with_surroundings(self, surroundings: Surroundings) -> ObjectMemory:
        """The same memory, of the same content hash, with these keyframes and maps."""
        return self._with(read_surroundings=lambda: surroundings)

    def _with(self, **changes: Any) -> ObjectMemory:
        """With other things around the same evidence."""
        return replace(self, table=NodeTable(replace(self.evidence, **changes), self.table.columns))

    def rebuilt(self, parameters: Parameters) -> ObjectMemory:
        """The memory that other parameters make of the same evidence; needs neither perception nor text encoder.

        Raises ValueError on another acquisition parameter: what it would have kept is not in the evidence.
        """
        for name in ACQUISITION:
            if getattr(parameters, name) != getattr(self.parameters, name):
                raise ValueError(f"Parameter {name} decides what is taken from a frame: map again with it.")
        observations = list(self.observations)
        partition = associate(observations, parameters)
        evidence = replace(self.evidence, observations=observations, partition=partition, parameters=parameters)
        return self.of(evidence, self.text_encoder)

    def save(self, path: str | os.PathLike[str]) -> None:
        """A finished .belief file, all of it or nothing; one that is there already is replaced.

        Raises BeliefFileError where it cannot be written.
        """
        saved_file.write(path, self.evidence, self.table.columns)

    def rank(
        self,
        query: MemoryQuery,
        readout: str = "consensus",
        exclude: Iterable[int] = frozenset(),
        limit: int | None = None,
    ) -> list[Candidate]:
        """Candidates, best first, ties by lowest id.

        query: a sentence (or one that was embedded, `asked`) ranks foreground nodes, background ones only when asked
        for by name: the paper's readouts by its target phrase, "grounded" by all that it says; a (d,) vector ranks
        every node. readout: "consensus" | "early" | "belief" | "grounded". exclude: R_q, object ids. limit: at most so
        many. Raises ValueError on an empty sentence, a vector that is not finite, a negative limit, or a sentence
        without an encoder.
        """
        known = check_readout(readout)
        _check_limit(limit)
        if not self._is_asked(query):
            return []
        if known == "grounded":
            return self._ranked_grounded(query, frozenset(exclude), limit)
        question = retrieval_query(query, known, self.table, self._text_space)
        return NodeScores(self.table, question).best(frozenset(exclude), limit)

    def asked(self, sentence: str | Request) -> EncodedRequest:
        """A sentence, parsed and embedded once. Raises ValueError where it names nothing, or without an encoder."""
        request = parse(sentence) if isinstance(sentence, str) else sentence
        return EncodedRequest(request, self._text_space.words)

    def reader(self, options: GroundedOptions | None = None) -> GroundedReader:
        """What reads this memory with the readout `grounded`; one for the same options."""
        chosen = options or GroundedOptions()
        if chosen not in self._readers:
            self._readers[chosen] = GroundedReader(
                lambda: map_table(self.table, self._text_space.words, chosen),
                self.rooms,
                self.text_encoder_id,
                chosen,
            )
        return self._readers[chosen]

    def answer(
        self,
        query: str | EncodedRequest,
        exclude: Iterable[int] = frozenset(),
        limit: int | None = None,
        *,
        viewer: Viewer | None = None,
        options: GroundedOptions | None = None,
    ) -> Answer:
        """What the readout `grounded` answers: found, unsure or not found, why, and the candidates with their terms.

        viewer: where the one who asks stands, for "nearest" and "on the left". Raises ValueError as `rank` does.
        """
        asked = self.asked(query) if isinstance(query, str) else query
        _check_limit(limit)
        return answer(self.reader(options).read(asked, viewer), lambda: self.table.phrases, frozenset(exclude), limit)

    def retrieve(
        self, query: MemoryQuery, readout: str = "consensus", exclude: Iterable[int] = frozenset()
    ) -> Candidate | None:
        """The best candidate outside R_q; None is the paper's NONE, and `nothing_because` says why."""
        return next(iter(self.rank(query, readout, exclude, limit=1)), None)

    def nothing_because(self, query: MemoryQuery, exclude: Iterable[int] = frozenset()) -> str | None:
        """Why `retrieve` gives None, in the operator's words; None where it gives a candidate."""
        if not len(self.table):
            return "the memory holds no objects"
        ids = set(np.flatnonzero(may_answer(query, self.table)).tolist())
        if not ids:
            return "the memory holds nothing but background (walls, floors)"
        if ids <= set(exclude):
            return f"all {len(ids)} candidates are excluded"
        return None

    def extent_alarms(self, objects: Sequence[ObjectNode] | None = None) -> list[ExtentAlarm]:
        """Objects (all by default) larger than their views explain, label = id: reported, never silently split."""
        alarms = []
        for node in self.objects if objects is None else objects:
            members = list(node.observations)
            alarms += extent_alarms(members, np.full(len(members), node.id), self.parameters)
        return alarms

    def project(self, classes: Sequence[str] | Array, readout: str = "full") -> Array:
        """(objects, classes) float64 class distributions; row i is `objects[i]`.

        classes: names or (C, d) embeddings. readout: "visual" | "consensus" | "early" | "full". Raises ValueError where
        the readout needs text-aligned features and this memory's are not.
        """
        known = check_projection(readout)
        table = self._text_space.classes(classes)
        one = project_node if self.feature_text_aligned else project_language
        rows = [one(node, table, known, self.parameters) for node in self.objects]
        return np.array(rows).reshape(len(self.objects), len(table))

    @cached_property
    def _text_space(self) -> TextSpace:
        return TextSpace(self.text_encoder_id, self.text_dim, self.text_encoder)

    @cached_property
    def _readers(self) -> dict[GroundedOptions, GroundedReader]:
        return {}

    def _ranked_grounded(self, query: MemoryQuery, exclude: frozenset[int], limit: int | None) -> list[Candidate]:
        reader = self.reader()
        if isinstance(query, str | EncodedRequest):
            return ranked(reader.read(self.asked(query) if isinstance(query, str) else query), exclude, limit)
        return ranked(reader.read_vector(self._text_space.vector(query)), exclude, limit)

    def _is_asked(self, query: MemoryQuery) -> bool:
        """False where there is nothing to rank, which needs no encoder; what asks nothing is refused all the same."""
        if len(self.table):
            return True
        if isinstance(query, str):
            target_phrase(query)
        return not isinstance(query, str | EncodedRequest)


def _check_limit(limit: Any) -> None:
    if limit is not None and not (isinstance(limit, Integral) and int(limit) >= 0):
        raise ValueError(f"The limit should be a whole number from 0 or None, got {limit!r}.")


def _check_features(evidence: Sequence[Observation], dim: int | None) -> None:
    for o in evidence:
        if dim is not None and len(o.feature) != dim:
            raise ValueError(
                f"Observation (frame {o.frame}, mask {o.mask}): its feature has {len(o.feature)} numbers, the text "
                f"encoder {dim}; where features are not text-aligned say feature_text_aligned=False."
            )


def _frames_of(evidence: Sequence[Observation]) -> tuple[FrameRecord, ...]:
    sources = {(o.recording, o.provenance.stamp_ns) for o in evidence if o.provenance}
    return tuple(FrameRecord(recording, stamp_ns) for recording, stamp_ns in sorted(sources))
