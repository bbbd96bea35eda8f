"""Chunks framed by hand are what protobuf makes and reads."""

import contextlib

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from meshsmooth import _wire
from meshsmooth.v1 import mesh_pb2, smoothing_pb2

DATA = st.binary(max_size=400)
OFFSETS = st.integers(0, 2**63 - 1)


@given(DATA, OFFSETS, st.integers(1, 6))
def test_encoded_chunk_equals_protobufs(data: bytes, offset: int, array_id: int) -> None:
    chunk = mesh_pb2.Chunk(array_id=array_id, offset_bytes=offset, data=data or b"\0")
    expected = smoothing_pb2.SmoothRequest(chunk=chunk).SerializeToString()
    assert _wire.encode_chunk(2, array_id, offset, memoryview(data or b"\0")) == expected


@given(DATA, OFFSETS, st.integers(1, 6), st.none() | st.integers(0, 2**32 - 1))
def test_found_chunk_equals_protobufs(
    data: bytes, offset: int, array_id: int, checksum: int | None
) -> None:
    chunk = mesh_pb2.Chunk(array_id=array_id, offset_bytes=offset, data=data)
    if checksum is not None:
        chunk.crc32c = checksum
    message = smoothing_pb2.SmoothResponse(chunk=chunk).SerializeToString()
    found = _wire.find_chunk(message, _wire.SMOOTH_RESPONSE_CHUNK)
    assert found is not None
    assert (found.array_id, found.offset_bytes, bytes(found.data)) == (array_id, offset, data)
    assert found.crc32c == checksum


def test_other_messages_are_no_chunks() -> None:
    summary = smoothing_pb2.SmoothResponse(summary=smoothing_pb2.Summary(stop_reason=1))
    assert _wire.find_chunk(summary.SerializeToString(), _wire.SMOOTH_RESPONSE_CHUNK) is None
    assert _wire.find_chunk(b"", _wire.SMOOTH_RESPONSE_CHUNK) is None


@given(st.binary(max_size=40))
def test_broken_chunks_are_refused_by_name(rest: bytes) -> None:
    with contextlib.suppress(_wire.Malformed):
        _wire.find_chunk(b"\x22" + rest, _wire.SMOOTH_RESPONSE_CHUNK)


def test_checksum_is_crc32c() -> None:
    assert _wire.crc32c(memoryview(b"123456789")) == 0xE3069283  # RFC 3720's check value


@given(
    st.lists(st.integers(0, 3 * _wire.CHUNK_BYTES // 2), min_size=1, max_size=3),
    st.sampled_from([0, 1000, 64 << 10, 2 << 20]),
)
def test_upload_sends_each_array_once_and_in_order(sizes: list[int], early_bytes: int) -> None:
    arrays = [np.resize(np.arange(251, dtype=np.uint8), size) for size in sizes]
    parts = [_wire.Part(i + 1, 0, _wire.bytes_of(a)) for i, a in enumerate(arrays)]
    upload = _wire.Upload(parts, early_bytes)
    messages = list(upload.chunks())
    assert sum(map(len, messages)) <= early_bytes + 32 * max(1, len(messages))
    assert upload.blocked or upload.complete
    upload.answered = True
    messages += upload.chunks()
    assert upload.complete
    received: dict[int, bytes] = {i + 1: b"" for i in range(len(sizes))}
    for message in messages:
        chunk = smoothing_pb2.SmoothRequest.FromString(message).chunk
        assert chunk.offset_bytes == len(received[chunk.array_id])
        assert 0 < len(chunk.data) <= _wire.CHUNK_BYTES
        received[chunk.array_id] += chunk.data
    assert list(received.values()) == [a.tobytes() for a in arrays]


def test_stopped_upload_sends_nothing_more() -> None:
    array = np.zeros(3 * _wire.CHUNK_BYTES, np.uint8)
    upload = _wire.Upload([_wire.Part(4, 0, _wire.bytes_of(array))], 1 << 20)
    upload.answered = True
    chunks = upload.chunks()
    next(chunks)
    upload.stopped = True
    with pytest.raises(StopIteration):
        next(chunks)
    assert upload.complete


@given(st.lists(st.integers(-(2**31), 2**31 - 1), max_size=50), st.integers(0, 50))
def test_long_indices_travel_as_short_ones(numbers: list[int], cut: int) -> None:
    array = np.array(numbers, np.int64)
    expected = array.astype("<i4").tobytes()
    view = _wire.node_bytes(array)
    assert view.nbytes == len(expected)
    assert b"".join(_wire.pieces(view)) == expected
    at = 4 * min(cut, len(numbers))
    assert isinstance(view, _wire.Int32View)
    assert bytes(view[:at].converted()) + bytes(view[at:].converted()) == expected
