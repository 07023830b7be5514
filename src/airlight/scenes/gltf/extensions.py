"""Say what extensions of a glTF file would change that Airlight leaves out."""

from collections.abc import Collection, Iterable

from airlight.scenes.gltf.container import shown

# What a picture lacks without them.
CHANGES = {
    "ADOBE_materials_thin_transparency": "panes",
    "EXT_lights_image_based": "the light of its surroundings; --environment gives others",
    "KHR_animation_pointer": "animated materials, lights and cameras",
    "KHR_environment_map": "the light of its surroundings; --environment gives others",
    "KHR_gaussian_splatting": "splats, shown as points",
    "KHR_interactivity": "what is clicked and moved",
    "KHR_materials_anisotropy": "brushed metal",
    "KHR_materials_clearcoat": "a coat of lacquer",
    "KHR_materials_diffuse_transmission": "light through leaves and paper",
    "KHR_materials_dispersion": "colours that glass parts",
    "KHR_materials_ior": "how strongly surfaces mirror",
    "KHR_materials_iridescence": "colours of thin films",
    "KHR_materials_sheen": "the shine of cloth",
    "KHR_materials_specular": "how strongly, and in which colour, surfaces mirror",
    "KHR_materials_subsurface": "light within skin and wax",
    "KHR_materials_variants": "other sets of materials; the first is shown",
    "KHR_materials_volume_scatter": "light within skin and wax",
    "KHR_physics_rigid_bodies": "what falls and collides",
    "KHR_texture_basisu": "compressed textures; what stands in for them is shown",
    "KHR_texture_procedurals": "computed textures",
    "MSFT_lod": "simpler meshes from afar",
    "MSFT_packing_normalRoughnessMetallic": "packed textures; what stands in for them is shown",
    "MSFT_packing_occlusionRoughnessMetallic": "packed textures; what stands in for them is shown",
    "MSFT_texture_dds": "compressed textures; what stands in for them is shown",
    "VRM": "faces, hair and clothes that move by themselves",
    "VRMC_materials_mtoon": "toon shading",
    "VRMC_springBone": "hair and clothes that move by themselves",
}
# They say something about the file, or to other programs, and change no picture.
SILENT = (
    "EXT_instance_features", "EXT_mesh_features", "EXT_structural_metadata", "EXT_mesh_manifold", "KHR_audio", "KHR_audio_emitter",
    "KHR_implicit_shapes", "KHR_node_hoverability", "KHR_node_selectability", "KHR_xmp", "KHR_xmp_json_ld", "CESIUM_primitive_outline",
    "MSFT_collision_mesh",
)  # fmt: skip


def ignored(used: Iterable[str], read: Collection[str]) -> str:
    """List the extensions that are used, are not `read` and may change a picture, with what each would change; empty for none."""
    left = sorted(set(used) - set(read) - set(SILENT))
    many = [f"{shown(name)[1:-1]} ({CHANGES.get(name, 'unknown')})" for name in left]
    return ", ".join(many[:20]) + (f" and {len(many) - 20} more" if len(many) > 20 else "")
