from google.protobuf.internal import containers as _containers
from google.protobuf.internal import enum_type_wrapper as _enum_type_wrapper
from google.protobuf import descriptor as _descriptor
from google.protobuf import message as _message
from typing import ClassVar as _ClassVar, Iterable as _Iterable, Mapping as _Mapping, Optional as _Optional, Union as _Union

ARRAY_ID_COORDINATES: ArrayId
ARRAY_ID_ELEMENTS: ArrayId
ARRAY_ID_ELEMENT_QUALITY: ArrayId
ARRAY_ID_ELEMENT_REGIONS: ArrayId
ARRAY_ID_FIXED_MASK: ArrayId
ARRAY_ID_NODE_PAIRS: ArrayId
ARRAY_ID_PRESCRIBED_COORDINATES: ArrayId
ARRAY_ID_PRESCRIBED_NODES: ArrayId
ARRAY_ID_REFERENCE_COORDINATES: ArrayId
ARRAY_ID_SURFACE_PATCHES: ArrayId
ARRAY_ID_SURFACE_POINTS: ArrayId
ARRAY_ID_SURFACE_TRIANGLES: ArrayId
ARRAY_ID_UNSPECIFIED: ArrayId
DESCRIPTOR: _descriptor.FileDescriptor
ELEMENT_TYPE_HEXAHEDRON: ElementType
ELEMENT_TYPE_HEXAHEDRON20: ElementType
ELEMENT_TYPE_HEXAHEDRON27: ElementType
ELEMENT_TYPE_PYRAMID: ElementType
ELEMENT_TYPE_PYRAMID13: ElementType
ELEMENT_TYPE_QUAD: ElementType
ELEMENT_TYPE_QUAD8: ElementType
ELEMENT_TYPE_QUAD9: ElementType
ELEMENT_TYPE_TETRAHEDRON: ElementType
ELEMENT_TYPE_TETRAHEDRON10: ElementType
ELEMENT_TYPE_TRIANGLE: ElementType
ELEMENT_TYPE_TRIANGLE6: ElementType
ELEMENT_TYPE_UNSPECIFIED: ElementType
ELEMENT_TYPE_WEDGE: ElementType
ELEMENT_TYPE_WEDGE15: ElementType
ELEMENT_TYPE_WEDGE18: ElementType
SCALAR_TYPE_FLOAT32: ScalarType
SCALAR_TYPE_FLOAT64: ScalarType
SCALAR_TYPE_INT32: ScalarType
SCALAR_TYPE_INT64: ScalarType
SCALAR_TYPE_UINT8: ScalarType
SCALAR_TYPE_UNSPECIFIED: ScalarType

class Chunk(_message.Message):
    __slots__ = ["array_id", "crc32c", "data", "offset_bytes"]
    ARRAY_ID_FIELD_NUMBER: _ClassVar[int]
    CRC32C_FIELD_NUMBER: _ClassVar[int]
    DATA_FIELD_NUMBER: _ClassVar[int]
    OFFSET_BYTES_FIELD_NUMBER: _ClassVar[int]
    array_id: ArrayId
    crc32c: int
    data: bytes
    offset_bytes: int
    def __init__(self, array_id: _Optional[_Union[ArrayId, str]] = ..., offset_bytes: _Optional[int] = ..., data: _Optional[bytes] = ..., crc32c: _Optional[int] = ...) -> None: ...

class ElementBlock(_message.Message):
    __slots__ = ["element_count", "element_type"]
    ELEMENT_COUNT_FIELD_NUMBER: _ClassVar[int]
    ELEMENT_TYPE_FIELD_NUMBER: _ClassVar[int]
    element_count: int
    element_type: ElementType
    def __init__(self, element_type: _Optional[_Union[ElementType, str]] = ..., element_count: _Optional[int] = ...) -> None: ...

class TopologySpec(_message.Message):
    __slots__ = ["element_blocks", "element_regions_present", "fixed_mask_present", "node_count", "reference_type"]
    ELEMENT_BLOCKS_FIELD_NUMBER: _ClassVar[int]
    ELEMENT_REGIONS_PRESENT_FIELD_NUMBER: _ClassVar[int]
    FIXED_MASK_PRESENT_FIELD_NUMBER: _ClassVar[int]
    NODE_COUNT_FIELD_NUMBER: _ClassVar[int]
    REFERENCE_TYPE_FIELD_NUMBER: _ClassVar[int]
    element_blocks: _containers.RepeatedCompositeFieldContainer[ElementBlock]
    element_regions_present: bool
    fixed_mask_present: bool
    node_count: int
    reference_type: ScalarType
    def __init__(self, node_count: _Optional[int] = ..., element_blocks: _Optional[_Iterable[_Union[ElementBlock, _Mapping]]] = ..., fixed_mask_present: bool = ..., element_regions_present: bool = ..., reference_type: _Optional[_Union[ScalarType, str]] = ...) -> None: ...

class ScalarType(int, metaclass=_enum_type_wrapper.EnumTypeWrapper):
    __slots__ = []

class ElementType(int, metaclass=_enum_type_wrapper.EnumTypeWrapper):
    __slots__ = []

class ArrayId(int, metaclass=_enum_type_wrapper.EnumTypeWrapper):
    __slots__ = []
