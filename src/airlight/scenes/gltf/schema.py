"""Describe the JSON of a glTF 2.0 file, as far as Airlight uses it (specification 2.0, section 5). The rest is skipped unread.

Names are those of the specification in snake case; None: absent, without a default of its own.
"""

from typing import Annotated, Any, Literal

import msgspec
from msgspec import Meta, field

from airlight.scenes.gltf import MAX_EXTENT

Index = Annotated[int, Meta(ge=0, le=2**31)]
Size = Annotated[int, Meta(ge=0, le=2**40)]
Count = Annotated[int, Meta(ge=1, le=2**31)]
Number = Annotated[float, Meta(ge=-MAX_EXTENT, le=MAX_EXTENT)]
Amount = Annotated[float, Meta(ge=0, le=1e30)]  # of light or distance
Text = Annotated[str, Meta(max_length=4096)]
Two = tuple[Number, Number]
Three = tuple[Number, Number, Number]
Four = tuple[Number, Number, Number, Number]


class Asset(msgspec.Struct, frozen=True, kw_only=True, rename="camel"):
    version: Text
    min_version: Text | None = None


class Compressed(msgspec.Struct, frozen=True, kw_only=True, rename="camel"):
    """Describes a compressed buffer view, of EXT_meshopt_compression and its successor."""

    buffer: Index
    byte_length: Size
    byte_stride: Annotated[int, Meta(ge=1, le=256)]
    count: Count
    mode: Literal["ATTRIBUTES", "TRIANGLES", "INDICES"]
    filter: Literal["NONE", "OCTAHEDRAL", "QUATERNION", "EXPONENTIAL", "COLOR"] = "NONE"
    byte_offset: Size = 0


class ViewExtensions(msgspec.Struct, frozen=True, kw_only=True, rename="camel"):
    meshopt: Compressed | None = field(default=None, name="EXT_meshopt_compression")
    meshopt_1: Compressed | None = field(default=None, name="KHR_meshopt_compression")


class Fallback(msgspec.Struct, frozen=True, kw_only=True, rename="camel"):
    fallback: bool = False


class BufferExtensions(msgspec.Struct, frozen=True, kw_only=True, rename="camel"):
    meshopt: Fallback = field(default=Fallback(), name="EXT_meshopt_compression")
    meshopt_1: Fallback = field(default=Fallback(), name="KHR_meshopt_compression")


class Buffer(msgspec.Struct, frozen=True, kw_only=True, rename="camel"):
    byte_length: Size
    uri: str | None = None
    extensions: BufferExtensions = BufferExtensions()


class BufferView(msgspec.Struct, frozen=True, kw_only=True, rename="camel"):
    buffer: Index
    byte_length: Size
    byte_offset: Size = 0
    byte_stride: Annotated[int, Meta(ge=0, le=4096)] | None = None  # 0: none either, as some programs write
    extensions: ViewExtensions = ViewExtensions()


class SparseIndices(msgspec.Struct, frozen=True, kw_only=True, rename="camel"):
    buffer_view: Index
    component_type: Literal[5121, 5123, 5125]
    byte_offset: Size = 0


class SparseValues(msgspec.Struct, frozen=True, kw_only=True, rename="camel"):
    buffer_view: Index
    byte_offset: Size = 0


class Sparse(msgspec.Struct, frozen=True, kw_only=True, rename="camel"):
    count: Count
    indices: SparseIndices
    values: SparseValues


class Accessor(msgspec.Struct, frozen=True, kw_only=True, rename="camel"):
    component_type: Literal[5120, 5121, 5122, 5123, 5125, 5126]
    count: Count
    type: Literal["SCALAR", "VEC2", "VEC3", "VEC4", "MAT2", "MAT3", "MAT4"]
    buffer_view: Index | None = None
    byte_offset: Size = 0
    normalized: bool = False
    sparse: Sparse | None = None


class TextureTransform(msgspec.Struct, frozen=True, kw_only=True, rename="camel"):
    offset: Two = (0.0, 0.0)
    rotation: Number = 0.0
    scale: Two = (1.0, 1.0)
    tex_coord: Index | None = None


class TextureExtensions(msgspec.Struct, frozen=True, kw_only=True, rename="camel"):
    transform: TextureTransform | None = field(default=None, name="KHR_texture_transform")


class TextureInfo(msgspec.Struct, frozen=True, kw_only=True, rename="camel"):
    index: Index
    tex_coord: Index = 0
    scale: Number = 1.0  # of a normal map
    strength: Number = 1.0  # of an occlusion map
    extensions: TextureExtensions = TextureExtensions()

    def same_place(self, other: "TextureInfo") -> bool:
        """Tell whether another texture lies on a mesh alike."""
        return (self.tex_coord, self.extensions) == (other.tex_coord, other.extensions)


class MetallicRoughness(msgspec.Struct, frozen=True, kw_only=True, rename="camel"):
    base_color_factor: Four = (1.0, 1.0, 1.0, 1.0)
    base_color_texture: TextureInfo | None = None
    metallic_factor: Number = 1.0
    roughness_factor: Number = 1.0
    metallic_roughness_texture: TextureInfo | None = None


class EmissiveStrength(msgspec.Struct, frozen=True, kw_only=True, rename="camel"):
    emissive_strength: Amount = 1.0


class Unlit(msgspec.Struct, frozen=True, kw_only=True, rename="camel"):
    pass


class Transmission(msgspec.Struct, frozen=True, kw_only=True, rename="camel"):
    transmission_factor: Number = 0.0
    transmission_texture: TextureInfo | None = None


class Volume(msgspec.Struct, frozen=True, kw_only=True, rename="camel"):
    thickness_factor: Number = 0.0
    attenuation_distance: Amount | None = None  # endless
    attenuation_color: Three = (1.0, 1.0, 1.0)


class SpecularGlossiness(msgspec.Struct, frozen=True, kw_only=True, rename="camel"):
    diffuse_factor: Four = (1.0, 1.0, 1.0, 1.0)
    diffuse_texture: TextureInfo | None = None
    specular_factor: Three = (1.0, 1.0, 1.0)
    glossiness_factor: Number = 1.0
    specular_glossiness_texture: TextureInfo | None = None


class MaterialExtensions(msgspec.Struct, frozen=True, kw_only=True, rename="camel"):
    emissive_strength: EmissiveStrength | None = field(default=None, name="KHR_materials_emissive_strength")
    specular_glossiness: SpecularGlossiness | None = field(default=None, name="KHR_materials_pbrSpecularGlossiness")
    transmission: Transmission | None = field(default=None, name="KHR_materials_transmission")
    volume: Volume | None = field(default=None, name="KHR_materials_volume")
    unlit: Unlit | None = field(default=None, name="KHR_materials_unlit")


def textures_of(found: MaterialExtensions) -> list[TextureInfo | None]:
    """List the textures that a material's extensions name."""
    more = [] if found.transmission is None else [found.transmission.transmission_texture]
    old = found.specular_glossiness
    return more if old is None else [*more, old.diffuse_texture, old.specular_glossiness_texture]


class Material(msgspec.Struct, frozen=True, kw_only=True, rename="camel"):
    name: str = ""
    pbr_metallic_roughness: MetallicRoughness = MetallicRoughness()
    normal_texture: TextureInfo | None = None
    occlusion_texture: TextureInfo | None = None
    emissive_texture: TextureInfo | None = None
    emissive_factor: Three = (0.0, 0.0, 0.0)
    alpha_mode: Literal["OPAQUE", "MASK", "BLEND"] = "OPAQUE"
    alpha_cutoff: Number = 0.5
    double_sided: bool = False
    extensions: MaterialExtensions = MaterialExtensions()


class Source(msgspec.Struct, frozen=True, kw_only=True, rename="camel"):
    source: Index | None = None


class SourceExtensions(msgspec.Struct, frozen=True, kw_only=True, rename="camel"):
    avif: Source | None = field(default=None, name="EXT_texture_avif")
    webp: Source | None = field(default=None, name="EXT_texture_webp")
    basisu: Source | None = field(default=None, name="KHR_texture_basisu")


class Texture(msgspec.Struct, frozen=True, kw_only=True, rename="camel"):
    sampler: Index | None = None
    source: Index | None = None
    extensions: SourceExtensions = SourceExtensions()


class Sampler(msgspec.Struct, frozen=True, kw_only=True, rename="camel"):
    mag_filter: Literal[9728, 9729] = 9729
    min_filter: Literal[9728, 9729, 9984, 9985, 9986, 9987] = 9987
    wrap_s: Literal[33071, 33648, 10497] = 10497
    wrap_t: Literal[33071, 33648, 10497] = 10497


class Image(msgspec.Struct, frozen=True, kw_only=True, rename="camel"):
    uri: str | None = None
    buffer_view: Index | None = None


class Draco(msgspec.Struct, frozen=True, kw_only=True, rename="camel"):
    buffer_view: Index
    attributes: dict[Text, Index]


class PrimitiveExtensions(msgspec.Struct, frozen=True, kw_only=True, rename="camel"):
    draco: Draco | None = field(default=None, name="KHR_draco_mesh_compression")


class Primitive(msgspec.Struct, frozen=True, kw_only=True, rename="camel"):
    attributes: dict[Text, Index]
    indices: Index | None = None
    material: Index | None = None
    mode: Literal[0, 1, 2, 3, 4, 5, 6] = 4
    targets: list[dict[Text, Index]] = []
    extensions: PrimitiveExtensions = PrimitiveExtensions()


class Mesh(msgspec.Struct, frozen=True, kw_only=True, rename="camel"):
    primitives: list[Primitive]
    weights: list[Number] = []
    name: str = ""


class Skin(msgspec.Struct, frozen=True, kw_only=True, rename="camel"):
    joints: list[Index]
    inverse_bind_matrices: Index | None = None


class Perspective(msgspec.Struct, frozen=True, kw_only=True, rename="camel"):
    yfov: Annotated[float, Meta(gt=0, lt=3.1416)]
    znear: Annotated[float, Meta(gt=0, le=1e30)]
    zfar: Annotated[float, Meta(gt=0, le=1e30)] | None = None


class Orthographic(msgspec.Struct, frozen=True, kw_only=True, rename="camel"):
    xmag: Number
    ymag: Number
    znear: Amount
    zfar: Annotated[float, Meta(gt=0, le=1e30)]


class Camera(msgspec.Struct, frozen=True, kw_only=True, rename="camel"):
    type: Literal["perspective", "orthographic"]
    name: str = ""
    perspective: Perspective | None = None
    orthographic: Orthographic | None = None


class NodeLight(msgspec.Struct, frozen=True, kw_only=True, rename="camel"):
    light: Index


class NodeProfile(msgspec.Struct, frozen=True, kw_only=True, rename="camel"):
    """Describes a light with the shape of a photometric file, of EXT_lights_ies."""

    light: Index
    multiplier: Amount = 1.0
    color: Three = (1.0, 1.0, 1.0)


class Instancing(msgspec.Struct, frozen=True, kw_only=True, rename="camel"):
    attributes: dict[Text, Index]


class Visibility(msgspec.Struct, frozen=True, kw_only=True, rename="camel"):
    visible: bool = True


class NodeExtensions(msgspec.Struct, frozen=True, kw_only=True, rename="camel"):
    light: NodeLight | None = field(default=None, name="KHR_lights_punctual")
    profile: NodeProfile | None = field(default=None, name="EXT_lights_ies")
    instancing: Instancing | None = field(default=None, name="EXT_mesh_gpu_instancing")
    visibility: Visibility = field(default=Visibility(), name="KHR_node_visibility")


class Node(msgspec.Struct, frozen=True, kw_only=True, rename="camel"):
    name: str = ""
    children: list[Index] = []
    mesh: Index | None = None
    skin: Index | None = None
    camera: Index | None = None
    weights: list[Number] = []
    translation: Three = (0.0, 0.0, 0.0)
    rotation: Four = (0.0, 0.0, 0.0, 1.0)
    scale: Three = (1.0, 1.0, 1.0)
    matrix: Annotated[list[Number], Meta(min_length=16, max_length=16)] | None = None
    extensions: NodeExtensions = NodeExtensions()


class Scene(msgspec.Struct, frozen=True, kw_only=True, rename="camel"):
    nodes: list[Index] = []
    name: str = ""


class Target(msgspec.Struct, frozen=True, kw_only=True, rename="camel"):
    path: str
    node: Index | None = None


class Channel(msgspec.Struct, frozen=True, kw_only=True, rename="camel"):
    sampler: Index
    target: Target


class AnimationSampler(msgspec.Struct, frozen=True, kw_only=True, rename="camel"):
    input: Index
    output: Index
    interpolation: Literal["LINEAR", "STEP", "CUBICSPLINE"] = "LINEAR"


class Animation(msgspec.Struct, frozen=True, kw_only=True, rename="camel"):
    channels: list[Channel]
    samplers: list[AnimationSampler]
    name: str = ""


class Spot(msgspec.Struct, frozen=True, kw_only=True, rename="camel"):
    inner_cone_angle: Amount = 0.0
    outer_cone_angle: Amount = 0.7853981633974483


class Light(msgspec.Struct, frozen=True, kw_only=True, rename="camel"):
    type: Literal["directional", "point", "spot"]
    name: str = ""
    color: Three = (1.0, 1.0, 1.0)
    intensity: Amount = 1.0
    range: Amount | None = None  # 0: none either
    spot: Spot = Spot()
    extras: Any = None


class Lights(msgspec.Struct, frozen=True, kw_only=True, rename="camel"):
    lights: list[Light] = []


class Profile(msgspec.Struct, frozen=True, kw_only=True, rename="camel"):
    uri: str | None = None
    buffer_view: Index | None = None
    name: str = ""


class Profiles(msgspec.Struct, frozen=True, kw_only=True, rename="camel"):
    lights: list[Profile] = []


class RootExtensions(msgspec.Struct, frozen=True, kw_only=True, rename="camel"):
    lights: Lights = field(default=Lights(), name="KHR_lights_punctual")
    profiles: Profiles = field(default=Profiles(), name="EXT_lights_ies")


class Document(msgspec.Struct, frozen=True, kw_only=True, rename="camel"):
    asset: Asset
    extensions_required: list[Text] = []
    extensions_used: list[Text] = []
    scene: Index | None = None
    scenes: list[Scene] = []
    nodes: list[Node] = []
    meshes: list[Mesh] = []
    skins: list[Skin] = []
    materials: list[Material] = []
    textures: list[Texture] = []
    samplers: list[Sampler] = []
    images: list[Image] = []
    accessors: list[Accessor] = []
    buffer_views: list[BufferView] = []
    buffers: list[Buffer] = []
    cameras: list[Camera] = []
    animations: list[Animation] = []
    extensions: RootExtensions = RootExtensions()
