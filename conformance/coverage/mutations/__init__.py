"""Mutations of the independent decoder: for each requirement one change that breaks it, so that some vector has to fail."""

from . import decoding, records, tools, values

# (requirement, file of the oracle, snippet, replacement); white space of a snippet stands for any white space
MUTATIONS = records.MUTATIONS + decoding.MUTATIONS + values.MUTATIONS + tools.MUTATIONS

# Requirements of which no mutation of the oracle can break the rule alone
NOT_MUTABLE = {
    "SS-SP-007": "defines times for players; nothing of decoding depends on them",
    "SS-IX-003": "the oracle reads frames without the index; nothing to break",
    "SS-PL-003": "the oracle reads frames without the operating points; nothing to break",
    "SS-OP-001": "a definition",
    "SS-OP-004": "follows from SS-OP-002, SS-RU-001 and SS-CA-003",
    "SS-OP-006": "a property of extracted streams, which follows from SS-OP-005",
    "SS-OUT-004": "the meaning of the output for renderers",
    "SS-LM-002": "says which limits are meant",
    "SS-LM-003": "about decoders with lower limits, which the oracle does not have",
}
