// Loops over pygfx's lights, as its own file of this name has them, with shadows by light_shadow.wgsl. A part of its fragment shaders.
$$ if receive_shadow
    let surface_facet = normalize(cross(dpdx(varyings.world_pos), dpdy(varyings.world_pos)));
    let surface_id = min(u_wobject.renderer_id, {{ airlight_casters - 1 }}u);
    let surface_casts = ((u_ambient_light.casters[surface_id >> 7u][(surface_id >> 5u) & 3u] >> (surface_id & 31u)) & 1u) == 1u;
$$ endif
$$ for kind, maps in (("point", "cube"), ("spot", "flat"), ("directional", "flat"))
$$ set count = {"point": num_point_lights, "spot": num_spot_lights, "directional": num_dir_lights}[kind]
$$ if count > 0
    for (var i = 0; i < {{ count }}; i++) {
        let light = u_{{ kind }}_lights[i];
        var punctual_light = get{{ kind.capitalize() }}LightInfo(light, geometry);
        if (!punctual_light.visible) { continue; }
        $$ if receive_shadow and airlight_casts[kind]
        if (light.cast_shadow != 0 && dot(surface_normal, punctual_light.direction) > 0.0) {
            let to_light = punctual_light.direction;
            let view = i32(light.shadow_bias){{ " + cube_face(-to_light)" if kind == "point" else "" }};
            let layer = view{{ " - %d" % airlight_flat_layers if kind == "point" else "" }};
            let lit = surface_shadow(u_{{ maps }}_maps, layer, view, geometry.position, surface_facet, to_light, surface_casts);
            punctual_light.color *= lit;
            $$ if airlight_glass
            punctual_light.color *= surface_left(view, geometry.position, surface_facet);
            $$ endif
        }
        $$ endif
        RE_Direct(punctual_light, geometry, material, &reflected_light);
    }
$$ endif
$$ endfor
