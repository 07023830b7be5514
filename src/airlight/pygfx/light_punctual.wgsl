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
        $$ if airlight_shapes[kind]
        // Shape it as shape.wgsl does for the air
        let shape = array<i32, {{ count }}>({{ airlight_shapes[kind] | join(", ") }})[i];
        if (shape >= 0) {
            let at = vec4f(geometry.position, 1.0);
            let scale = u_ambient_light.shape_scales[shape]; // of the shape; its kind; texels along its longer side
            let falls = u_ambient_light.shape_falls[shape]; // of 1 / d^2, 1 / d, 1; how many planes bound the light
            let rows = 3 * shape;
            let q = vec3f(
                dot(u_ambient_light.shape_rows[rows], at), dot(u_ambient_light.shape_rows[rows + 1], at), dot(u_ambient_light.shape_rows[rows + 2], at)
            );
            var lit = 1.0;
            for (var k = 0; k < i32(falls.w); k++) { lit *= f32(dot(u_ambient_light.shape_planes[{{ airlight_planes }} * shape + k], at) >= 0.0); }
            var uv = vec2f(0.5);
            if (scale.z == 3.0) {
                uv = vec2f(fract(atan2(q.y, q.x) / 6.28318531), atan2(length(q.xy), q.z) / 3.14159265);
                uv = vec2f(uv.x + 0.5 / {{ airlight_side }}.0, (uv.y * ({{ airlight_side }}.0 - 1.0) + 0.5) / {{ airlight_side }}.0);
            } else if (scale.z == 2.0) {
                uv += vec2f(q.x, -q.y) * scale.xy;
            } else if (scale.z == 1.0) {
                lit *= f32(q.z > 0.0);
                uv = clamp(uv + vec2f(q.x, -q.y) * scale.xy / max(q.z, 1e-9), vec2f(0.5 / {{ airlight_side }}.0), vec2f(1.0 - 0.5 / {{ airlight_side }}.0));
            }
            let d = length(q);
            let fall = {{ "1.0" if kind == "directional" else "falls.x + d * (falls.y + d * falls.z)" }};
            punctual_light.color *= lit * fall * textureSampleLevel(t_shapes, s_shapes, uv, shape, 0.0).rgb;
        }
        $$ endif
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
