#!/usr/bin/env python3
"""Builds and renders the scene beside this file with Blender Cycles.

    blender -b -P scene.py -- [options]     in Blender, 4.2 or later
    python scene.py [options]               with the bpy module of PyPI

What is in the scene stands in scene.json, in Blender's conventions: +Z up, metres, watts, linear Rec.709, v upwards.
The numbers of meshes and points stand in floats.npy and integers.npy; a [start, length] pair in scene.json is a part of
one of them. This program is the same for every scene.
"""
import argparse
import json
import math
import os
import sys
import time
import traceback

import bpy  # first: with the PyPI module it brings the ones below
import numpy
from mathutils import Matrix, Vector

HERE = os.path.dirname(os.path.abspath(__file__))


def main():
    options = read_options()
    with open(os.path.join(HERE, "scene.json"), encoding="utf-8") as file:
        spec = json.load(file)
    say(f"Blender {bpy.app.version_string}")
    started = time.perf_counter()
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    neutral_settings(scene, spec["settings"], options)
    build(scene, spec)
    say(f"BUILD_SECONDS {time.perf_counter() - started:.3f}")
    if spec["save_blend"] and not options.save_blend:
        options.save_blend = os.path.join(HERE, "scene.blend")
    if options.save_blend:
        bpy.ops.wm.save_as_mainfile(filepath=options.save_blend, check_existing=False)
        say(f"saved {options.save_blend}")
    if not options.no_render:
        render(scene, options.output)


def read_options():
    parser = argparse.ArgumentParser(prog="scene.py", description="Renders the scene beside this file with Cycles.")
    parser.add_argument("--output", metavar="FILE.exr", default=os.path.join(HERE, "scene.exr"))
    parser.add_argument("--samples", type=int, help="per pixel")
    parser.add_argument("--seed", type=int)
    parser.add_argument("--threads", type=int, help="default: as many as there are")
    parser.add_argument("--save-blend", metavar="FILE", nargs="?", const=os.path.join(HERE, "scene.blend"))
    parser.add_argument("--no-render", action="store_true")
    if "--" in sys.argv:
        arguments = sys.argv[sys.argv.index("--") + 1 :]
    else:
        arguments = sys.argv[1:] if bpy.app.module else []
    options = parser.parse_args(arguments)
    options.output = os.path.abspath(options.output)
    if options.save_blend:
        options.save_blend = os.path.abspath(options.save_blend)
    return options


def say(line):
    print(line, flush=True)


def render(scene, output):
    scene.render.filepath = output
    shown = [0.0]

    def progress(stats, *_):
        if "Sample" in stats and time.perf_counter() - shown[0] > 2:
            shown[0] = time.perf_counter()
            say(stats[stats.index("Sample") :])

    bpy.app.handlers.render_stats.append(progress)
    started = time.perf_counter()
    bpy.ops.render.render(write_still=True)
    say(f"RENDER_SECONDS {time.perf_counter() - started:.3f}")
    if not os.path.isfile(output):
        raise RuntimeError(f"Blender did not write {output}")


# Settings


def neutral_settings(scene, settings, options):
    """Nothing but the scene decides the picture: no clamping, denoising, adaptive sampling or tone curve."""
    target, cycles = scene.render, scene.cycles
    target.engine = "CYCLES"
    cycles.device = "CPU"
    cycles.samples = options.samples or settings["samples"]
    cycles.seed = settings["seed"] if options.seed is None else options.seed
    cycles.use_adaptive_sampling = cycles.use_denoising = cycles.use_guiding = False
    cycles.time_limit = 0
    bounces = settings["bounces"]
    cycles.max_bounces = bounces["total"]
    cycles.diffuse_bounces = bounces["diffuse"]
    cycles.glossy_bounces = bounces["glossy"]
    cycles.transmission_bounces = bounces["transmission"]
    cycles.volume_bounces = 0
    cycles.transparent_max_bounces = 1024
    cycles.min_light_bounces = cycles.min_transparent_bounces = 0
    cycles.sample_clamp_direct = cycles.sample_clamp_indirect = 0
    cycles.blur_glossy = cycles.light_sampling_threshold = 0
    cycles.caustics_reflective = cycles.caustics_refractive = True
    cycles.use_fast_gi = False
    cycles.film_exposure = 1
    cycles.pixel_filter_type = settings["filter"]["type"]
    cycles.filter_width = settings["filter"]["width"]
    target.film_transparent = False
    target.use_persistent_data = target.use_motion_blur = False
    target.use_compositing = target.use_sequencer = False
    target.threads_mode = "FIXED" if options.threads else "AUTO"
    if options.threads:
        target.threads = options.threads
    target.resolution_x, target.resolution_y = settings["size"]
    target.resolution_percentage = 100
    target.pixel_aspect_x = target.pixel_aspect_y = 1
    if settings["crop"]:
        target.use_border = target.use_crop_to_border = True
        target.border_min_x, target.border_max_x, target.border_min_y, target.border_max_y = settings["crop"]
    view = scene.view_settings
    view.view_transform, view.look, view.exposure, view.gamma = "Standard", "None", 0, 1
    image = target.image_settings
    image.file_format, image.color_mode, image.color_depth, image.exr_codec = "OPEN_EXR", "RGB", "32", "ZIP"
    target.use_file_extension = False


def set_where_known(owner, **settings):
    """For what not every version has."""
    for name, value in settings.items():
        if hasattr(owner, name):
            setattr(owner, name, value)


# The scene


def build(scene, spec):
    arrays = Arrays()
    images = [load_image(image) for image in spec["images"]]
    materials = [build_material(material, images) for material in spec["materials"]]
    meshes = [build_mesh(mesh, arrays) for mesh in spec["meshes"]]
    say(f"{len(meshes)} meshes, {len(materials)} materials, {len(images)} images")
    for instance in spec["instances"]:
        place(scene, instance, meshes[instance["mesh"]], materials)
    add_spheres(scene, spec["points"], arrays, materials)
    for light in spec["lights"]:
        add_light(scene, light)
    set_world(scene, spec["world"], images)
    set_camera(scene, spec["camera"])


class Arrays:
    def __init__(self):
        self.floats = numpy.load(os.path.join(HERE, "floats.npy"))
        self.integers = numpy.load(os.path.join(HERE, "integers.npy"))

    def f(self, part):
        return self.floats[part[0] : part[0] + part[1]]

    def i(self, part):
        return self.integers[part[0] : part[0] + part[1]]


def build_mesh(spec, arrays):
    mesh = bpy.data.meshes.new(spec["name"])
    positions, corners = arrays.f(spec["positions"]), arrays.i(spec["triangles"])
    triangles = len(corners) // 3
    mesh.vertices.add(len(positions) // 3)
    mesh.vertices.foreach_set("co", positions)
    mesh.loops.add(len(corners))
    mesh.loops.foreach_set("vertex_index", corners)
    mesh.polygons.add(triangles)
    mesh.polygons.foreach_set("loop_start", numpy.arange(0, len(corners), 3, dtype=numpy.int32))
    for _ in range(spec["slot_count"]):
        mesh.materials.append(None)
    if spec["slots"]:
        mesh.polygons.foreach_set("material_index", arrays.i(spec["slots"]))
    for name, part in zip(("UV0", "UV1"), spec["uvs"]):
        if part:
            layer = mesh.uv_layers.new(name=name, do_init=False)
            layer.uv.foreach_set("vector", arrays.f(part).reshape(-1, 2)[corners].ravel())
    if spec["colors"]:
        add_attribute(mesh, "Color", "FLOAT_COLOR", "POINT", "color", arrays.f(spec["colors"]))
    if spec["tangents"]:
        # Under these names the Normal Map node looks for what Cycles makes of a UV map "Given"; 5.0 for the second.
        domain = "CORNER" if spec["tangents_by_corner"] else "POINT"
        for name in ("Given.tangent", "Given.undisplaced_tangent"):
            add_attribute(mesh, name, "FLOAT_VECTOR", domain, "vector", arrays.f(spec["tangents"]))
            add_attribute(mesh, f"{name}_sign", "FLOAT", domain, "value", arrays.f(spec["tangent_signs"]))
    mesh.update(calc_edges=True)
    if not spec["normals"]:
        mesh.shade_flat()
    elif bpy.app.version >= (4, 5):
        add_attribute(mesh, "custom_normal", "FLOAT_VECTOR", "POINT", "vector", arrays.f(spec["normals"]))
    else:
        mesh.normals_split_custom_set_from_vertices(arrays.f(spec["normals"]).reshape(-1, 3))
    return mesh


def add_attribute(geometry, name, kind, domain, field, numbers):
    geometry.attributes.new(name, kind, domain).data.foreach_set(field, numbers)


def place(scene, spec, mesh, materials):
    thing = bpy.data.objects.new(spec["name"], mesh)
    scene.collection.objects.link(thing)
    dress(thing, mesh, [materials[material] for material in spec["materials"]])
    faithful_shadows(thing)
    if spec["matrix"]:
        matrix = Matrix(spec["matrix"])
        thing.matrix_basis = matrix
        if not close(thing.matrix_basis, matrix):
            # It shears, which place, turn and scale cannot; an inverse of a parent can.
            thing.matrix_basis = Matrix()
            thing.parent = sheared(scene)
            thing.matrix_parent_inverse = matrix


def dress(thing, mesh, chosen):
    """Materials belong to the mesh as far as they can: objects with materials of their own share no geometry in Cycles."""
    if not any(mesh.materials):
        for i, material in enumerate(chosen):
            mesh.materials[i] = material
        return
    for slot, given, material in zip(thing.material_slots, mesh.materials, chosen):
        if given is not material:
            slot.link = "OBJECT"
            slot.material = material


def close(a, b):
    size = max(abs(x) for row in b.to_3x3() for x in row)
    return all(abs(x - y) <= 1e-5 * size for p, q in zip(a.to_3x3(), b.to_3x3()) for x, y in zip(p, q))


def sheared(scene):
    """What sheared objects hang on."""
    name = "Sheared"
    if name not in bpy.data.objects:
        scene.collection.objects.link(bpy.data.objects.new(name, None))
    return bpy.data.objects[name]


def faithful_shadows(thing):
    """Shadow rays begin where the surface is. The properties moved from Cycles to the object itself."""
    set_where_known(thing.cycles, shadow_terminator_offset=0, shadow_terminator_geometry_offset=0)
    set_where_known(thing, shadow_terminator_shading_offset=0, shadow_terminator_geometry_offset=0)


def add_spheres(scene, specs, arrays, materials):
    """Points of a point cloud are true spheres in Cycles. They are made from loose vertices."""
    things = []
    for spec in specs:
        mesh = bpy.data.meshes.new(spec["name"])
        mesh.vertices.add(spec["centers"][1] // 3)
        mesh.vertices.foreach_set("co", arrays.f(spec["centers"]))
        add_attribute(mesh, "radius", "FLOAT", "POINT", "value", arrays.f(spec["radii"]))
        mesh.materials.append(materials[spec["material"]])
        thing = bpy.data.objects.new(spec["name"], mesh)
        scene.collection.objects.link(thing)
        things.append(thing)
    if not things:
        return
    chosen = {"object": things[0], "active_object": things[0]}
    with bpy.context.temp_override(**chosen, selected_objects=things, selected_editable_objects=things):
        bpy.ops.object.convert(target="POINTCLOUD")
    for thing in things:
        if thing.type != "POINTCLOUD":
            raise RuntimeError(f"Blender did not make a point cloud of {thing.name}")
        faithful_shadows(thing)


def set_camera(scene, spec):
    data = bpy.data.cameras.new("Camera")
    thing = bpy.data.objects.new("Camera", data)
    scene.collection.objects.link(thing)
    scene.camera = thing
    thing.matrix_basis = Matrix(spec["matrix"])
    data.sensor_fit = "VERTICAL"
    data.type = spec["type"]
    if spec["type"] == "ORTHO":
        data.ortho_scale = spec["height"]
    else:
        data.lens, data.sensor_height = spec["lens"], spec["sensor_height"]
    data.clip_start, data.clip_end = spec["clip"]
    if spec["fstop"]:
        data.dof.use_dof = True
        data.dof.focus_distance, data.dof.aperture_fstop = spec["focus"], spec["fstop"]
        data.dof.aperture_blades, data.dof.aperture_ratio = 0, 1


# Light


def add_light(scene, spec):
    light = bpy.data.lights.new(spec["name"], spec["type"])
    thing = bpy.data.objects.new(spec["name"], light)
    scene.collection.objects.link(thing)
    strength = max(spec["strength"])
    light.energy, light.color = strength, [c / strength for c in spec["strength"]]
    set_where_known(light, use_soft_falloff=False)
    light.cycles.use_multiple_importance_sampling = True
    light.cycles.max_bounces = 1024
    if spec["type"] == "SUN":
        light.angle = spec["angle"]
    else:
        light.shadow_soft_size = spec["radius"]
        thing.location = spec["position"]
    if spec["type"] == "SPOT":
        light.spot_size, light.spot_blend = spec["spot_size"], 0
    if spec["direction"]:
        thing.rotation_mode = "QUATERNION"
        thing.rotation_quaternion = Vector(spec["direction"]).to_track_quat("-Z", "Y")
    if spec["cone"]:
        set_cone(light, spec)


def set_cone(light, spec):
    """((cos θ − cos outer) / (cos inner − cos outer))², as in KHR_lights_punctual."""
    light.use_nodes = True
    graph = Graph(light.node_tree)
    incoming = graph.node("ShaderNodeNewGeometry").outputs["Incoming"]
    cos = graph.vector("DOT_PRODUCT", incoming, spec["direction"])
    cos_outer, scale = spec["cone"]
    share = graph.math("MULTIPLY", graph.math("SUBTRACT", cos, cos_outer), scale, clamp=True)
    emission = graph.node("ShaderNodeEmission", Strength=graph.math("MULTIPLY", share, share))
    graph.finish("ShaderNodeOutputLight", emission)


def set_world(scene, spec, images):
    world = bpy.data.worlds.new("World")
    scene.world = world
    if world.node_tree is None:
        world.use_nodes = True
    graph = Graph(world.node_tree)
    world.cycles_visibility.camera = spec["visible"]
    if spec["type"] == "color":
        color = spec["color"]
    elif spec["type"] == "gradient":
        z = graph.split(graph.node("ShaderNodeTexCoord").outputs["Generated"])[2]
        color = graph.mix(graph.math("MULTIPLY_ADD", z, 0.5, 0.5), spec["bottom"], spec["top"])
    else:
        world.cycles.sampling_method = "MANUAL"
        world.cycles.sample_map_resolution = spec["map_resolution"]
        color = environment_image(graph, spec, images[spec["image"]])
    graph.finish("ShaderNodeOutputWorld", graph.node("ShaderNodeBackground", Color=color, Strength=spec["strength"]))


def environment_image(graph, spec, image):
    """Between the middle of the first or last row and the pole next to it the radiance stays as it is in that row."""
    direction = graph.node("ShaderNodeTexCoord").outputs["Generated"]
    direction = graph.node("ShaderNodeVectorRotate", rotation_type="Z_AXIS", Vector=direction, Angle=-spec["rotation"])
    x, y, z = graph.split(direction.outputs[0])
    z = graph.math("MAXIMUM", graph.math("MINIMUM", z, spec["highest"]), -spec["highest"])
    across = graph.math("SQRT", graph.math("SUBTRACT", 1, graph.math("MULTIPLY", z, z)))
    flat = graph.vector("NORMALIZE", graph.join(x, y, 0))
    kept = graph.vector("MULTIPLY_ADD", flat, graph.join(across, across, 0), graph.join(0, 0, z))
    return graph.node("ShaderNodeTexEnvironment", image=image, interpolation="Linear", Vector=kept).outputs["Color"]


# Materials


def load_image(spec):
    image = bpy.data.images.load(os.path.join(HERE, *spec["file"].split("/")))
    image.colorspace_settings.name = spec["color_space"]
    image.alpha_mode = "CHANNEL_PACKED"
    return image


def build_material(spec, images):
    material = bpy.data.materials.new(spec["name"])
    if material.node_tree is None:
        material.use_nodes = True
    material.cycles.emission_sampling = spec["emission_sampling"]
    set_where_known(material.cycles, use_bump_map_correction=spec["bump_correction"])
    graph = Graph(material.node_tree)
    inputs = Inputs(graph, spec, images)
    shader = SURFACES[spec["surface"]["type"]](graph, inputs, spec["surface"])
    if spec["emission"]:
        glow = emission(graph, inputs, spec["emission"])
        shader = graph.node("ShaderNodeAddShader", {0: shader, 1: glow}) if shader else glow
    if spec["alpha"]:
        shader = graph.mix_shader(openness(graph, inputs, spec["alpha"]), shader, transparent(graph))
    if spec["cull_backs"]:
        back = graph.node("ShaderNodeNewGeometry").outputs["Backfacing"]
        camera = graph.node("ShaderNodeLightPath").outputs["Is Camera Ray"]
        shader = graph.mix_shader(graph.math("MULTIPLY", back, camera), shader, transparent(graph))
    graph.finish("ShaderNodeOutputMaterial", shader, absorption(graph, spec["absorption"]))
    return material


def absorption(graph, spec):
    return graph.node("ShaderNodeVolumeAbsorption", Color=spec["color"], Density=spec["density"]) if spec else None


def transparent(graph):
    return graph.node("ShaderNodeBsdfTransparent")


def openness(graph, inputs, spec):
    """The share of light that passes."""
    coverage = inputs.value(spec["coverage"])
    if spec["vertex"]:
        coverage = graph.math("MULTIPLY", coverage, inputs.vertex_color().outputs["Alpha"])
    if spec["cutoff"] is not None:
        return graph.math("LESS_THAN", coverage, spec["cutoff"])
    return graph.math("SUBTRACT", 1, coverage, clamp=True)


def emission(graph, inputs, spec):
    strength = spec["strength"]
    if not spec["two_sided"]:
        back = graph.node("ShaderNodeNewGeometry").outputs["Backfacing"]
        strength = graph.math("MULTIPLY_ADD", back, -strength, strength)
    if spec["camera_only"]:
        camera = graph.node("ShaderNodeLightPath").outputs["Is Camera Ray"]
        strength = graph.math("MULTIPLY", camera, strength)
    if spec["passed"]:
        strength = graph.math("MULTIPLY", inputs.by_angle(spec["passed"]), strength)
    return graph.node("ShaderNodeEmission", Color=inputs.color(spec["color"]), Strength=strength)


def diffuse(graph, inputs, spec):
    return graph.node("ShaderNodeBsdfDiffuse", Color=inputs.color(spec["color"]), Normal=inputs.normal())


def glossy(graph, inputs, spec):
    return graph.node(
        "ShaderNodeBsdfAnisotropic",
        distribution=spec["distribution"],
        Color=inputs.color(spec["color"]),
        Roughness=inputs.value(spec["roughness"]),
        Normal=inputs.normal(),
    )


def glass(graph, inputs, spec):
    return graph.node(
        "ShaderNodeBsdfGlass",
        distribution="MULTI_GGX",
        Color=inputs.color(spec["color"]),
        Roughness=inputs.value(spec["roughness"]),
        IOR=spec["ior"],
        Normal=inputs.normal(),
    )


def schlick_glass(graph, inputs, spec):
    """Smooth glass that reflects R₀ + (1 − R₀)(1 − cos θ)⁵, with θ the angle on the thinner side."""
    color, ior = inputs.color(spec["color"]), spec["ior"]
    geometry = graph.node("ShaderNodeNewGeometry")
    back = geometry.outputs["Backfacing"]
    cos = graph.vector("DOT_PRODUCT", inputs.normal() or geometry.outputs["Normal"], geometry.outputs["Incoming"])
    # Leaving the denser side: cos² of the refracted ray is 1 − n² (1 − cos²), n the denser index over the other.
    n2 = max(ior, 1 / ior) ** 2
    refracted = graph.math("MULTIPLY_ADD", graph.math("MULTIPLY", cos, cos), n2, 1 - n2)
    refracted = graph.math("SQRT", graph.math("MAXIMUM", refracted, 0))
    inside, outside = (cos, refracted) if ior < 1 else (refracted, cos)
    thin = graph.mix_values(back, outside, inside)
    power = graph.math("POWER", graph.math("SUBTRACT", 1, thin, clamp=True), 5)
    r0 = ((ior - 1) / (ior + 1)) ** 2
    share = graph.math("MULTIPLY_ADD", power, 1 - r0, r0)
    settings = {"Color": color, "Roughness": 0, "Normal": inputs.normal()}
    refraction = graph.node("ShaderNodeBsdfRefraction", IOR=ior, **settings)
    return graph.mix_shader(share, refraction, graph.node("ShaderNodeBsdfAnisotropic", **settings))


# Without layers, and with Schlick's edge for metals: white.
PLAIN = {f"{name} Weight": 0 for name in ("Subsurface", "Transmission", "Coat", "Sheen")}
PLAIN.update({"Specular IOR Level": 0.5, "Specular Tint": (1, 1, 1), "Anisotropic": 0, "Emission Strength": 0})


def principled(graph, inputs, spec):
    settings = {
        "Base Color": inputs.color(spec["color"]),
        "Metallic": inputs.value(spec["metallic"]),
        "Roughness": inputs.value(spec["roughness"]),
        "IOR": spec["ior"],
        "Normal": inputs.normal(),
    }
    return graph.node("ShaderNodeBsdfPrincipled", {**PLAIN, **settings}, distribution=spec["distribution"])


def specular_glossiness(graph, inputs, spec):
    """A dielectric that reflects `specular` head on, all at grazing angles, over diffuse (1 − max specular)."""
    specular = inputs.color(spec["specular"])
    if isinstance(specular, list):
        greatest = max(specular)
    else:
        r, g, b = graph.split(specular)
        greatest = graph.math("MAXIMUM", graph.math("MAXIMUM", r, g), b)
    settings = {
        "Base Color": graph.times_color(inputs.color(spec["diffuse"]), graph.rest(greatest)),
        "Metallic": 0,
        "Roughness": graph.rest(inputs.value(spec["glossiness"])),
        "IOR": 1.5,
        "Specular Tint": graph.times_color(specular, 25),  # of 0.04
        "Normal": inputs.normal(),
    }
    return graph.node("ShaderNodeBsdfPrincipled", {**PLAIN, **settings}, distribution="MULTI_GGX")


def layered(graph, inputs, spec):
    return Layered(graph, inputs, spec).shader()


class Layered:
    """Principled, once for each part that layers mix, and what it has no sockets for added to it."""

    def __init__(self, graph, inputs, spec):
        self.graph, self.inputs, self.spec = graph, inputs, spec
        self.color = inputs.color(spec["color"])
        self.settings = {**PLAIN, "IOR": spec["ior"], "Normal": inputs.normal(), **self.roughness()}
        self.settings.update(self.coat())
        self.settings.update(self.sheen())

    def shader(self):
        graph, spec = self.graph, self.spec
        metallic, through = self.inputs.value(spec["metallic"]), self.share(spec["transmission"])
        scattered = self.share(spec["diffuse_transmission"] and spec["diffuse_transmission"]["factor"])
        if is_number(through, 0) and is_number(scattered, 0):
            return self.part(self.color, metallic)
        if is_number(metallic, 1):
            return self.part(self.color, 1)
        wall, solid = (0, through) if spec["solid"] else (through, 0)
        below = graph.times(graph.rest(wall), graph.rest(scattered))
        dielectric = self.part(graph.times_color(self.color, below), 0)
        if not is_number(scattered, 0):
            share = graph.times(scattered, graph.rest(wall))
            color = self.passing(self.inputs.color(spec["diffuse_transmission"]["color"]), share)
            behind = graph.node("ShaderNodeBsdfTranslucent", Color=color, Normal=self.inputs.normal())
            dielectric = graph.node("ShaderNodeAddShader", {0: dielectric, 1: behind})
        if not is_number(wall, 0):
            color = self.passing(self.color, wall)
            straight = graph.node("ShaderNodeBsdfRefraction", Color=color, IOR=1, Roughness=0)
            dielectric = graph.node("ShaderNodeAddShader", {0: dielectric, 1: straight})
        if not is_number(solid, 0):
            # Principled tints by the root of its colour at each boundary.
            glass = self.part(graph.times_color(self.color, self.color), 0, transmission=1)
            dielectric = graph.blend(solid, dielectric, glass)
        return graph.blend(metallic, dielectric, None if is_number(metallic, 0) else self.part(self.color, 1))

    def part(self, color, metallic, transmission=0):
        spec, graph = self.spec, self.graph
        settings = {**self.settings, "Base Color": color, "Metallic": metallic, "Transmission Weight": transmission}
        node = lambda more: graph.node("ShaderNodeBsdfPrincipled", {**settings, **more}, distribution=spec["distribution"])
        specular, film = spec["specular"], spec["film"]
        factor = self.share(specular["factor"]) if specular else 1
        bare, filmed = {}, {}
        if film:
            filmed = {"Thin Film IOR": film["ior"], "Thin Film Thickness": self.thickness(film)}
        if specular:
            tint = self.inputs.color(specular["tint"])
            whole = graph.at_most(tint, specular["most"])
            scaled = graph.times_color(whole, factor)
            filmed["Specular Tint"] = scaled
            bare["Specular Tint"] = scaled if transmission else whole
        weight = self.share(film["weight"]) if film else 0
        shader = None
        if not is_number(weight, 1):
            shader = node(bare)
            if not transmission and not is_number(metallic, 1) and not is_number(factor, 1):
                shader = graph.blend(factor, node({**bare, "Specular IOR Level": 0}), shader)
        return graph.blend(weight, shader, None if is_number(weight, 0) else node(filmed))

    def share(self, spec):
        return self.inputs.value(spec) if spec else 0

    def thickness(self, film):
        thin, thick = film["thickness"]
        if not film["thickness_texture"]:
            return thick
        return self.graph.math("MULTIPLY_ADD", self.inputs.value(film["thickness_texture"]), thick - thin, thin)

    def coat(self):
        spec = self.spec["coat"]
        if not spec:
            return {}
        return {
            "Coat Weight": self.outside(self.inputs.value(spec["weight"])),
            "Coat Roughness": self.inputs.value(spec["roughness"]),
            "Coat IOR": 1.5,
            "Coat Tint": (1, 1, 1),
            "Coat Normal": self.inputs.make_normal(spec["normal"]) if spec["normal"] else None,
        }

    def sheen(self):
        spec = self.spec["sheen"]
        if not spec:
            return {}
        roughness = self.inputs.value(spec["roughness"])
        return {"Sheen Weight": self.outside(1), "Sheen Roughness": roughness, "Sheen Tint": self.inputs.color(spec["color"])}

    def outside(self, weight):
        """Of a solid: not met from within."""
        if not (self.spec["solid"] and (self.spec["transmission"] or self.spec["diffuse_transmission"])):
            return weight
        back = self.graph.node("ShaderNodeNewGeometry").outputs["Backfacing"]
        return self.graph.times(weight, self.graph.rest(back))

    def passing(self, color, share):
        """What layers above leave of a share of a colour."""
        share = self.graph.times(share, self.inputs.by_angle(self.spec["passed"]))
        return self.graph.times_color(color, share)

    def roughness(self):
        """α = roughness². Along the direction of anisotropy it is α + (1 − α) strength², across α. Cycles has α/aspect and
        α aspect, aspect² = 1 − 0.9 anisotropy."""
        roughness, spec, graph = self.inputs.value(self.spec["roughness"]), self.spec["anisotropy"], self.graph
        if not spec:
            return {"Roughness": roughness}
        strength, x, y = spec["strength"], math.cos(spec["rotation"]), math.sin(spec["rotation"])
        if spec["texture"]:
            u, v, blue = graph.split(self.inputs.texel(spec["texture"]).outputs["Color"])
            strength = graph.math("MULTIPLY", blue, strength)
            u, v = (graph.math("MULTIPLY_ADD", c, 2, -1) for c in (u, v))
            turned = lambda a, b: graph.math("ADD", graph.math("MULTIPLY", u, a), graph.math("MULTIPLY", v, b))
            x, y = turned(x, -y), turned(y, x)
        narrow = graph.at_least(graph.times(roughness, roughness), 1e-4)
        wide = graph.plus(narrow, graph.times(graph.rest(narrow), graph.times(strength, strength)))
        if is_number(narrow) and is_number(wide):
            stretch, mean = min((1 - narrow / wide) / 0.9, 1), (narrow * wide) ** 0.25
        else:
            stretch = graph.math("DIVIDE", graph.rest(graph.math("DIVIDE", narrow, wide)), 0.9, clamp=True)
            mean = graph.math("POWER", graph.math("MULTIPLY", narrow, wide), 0.25)
        return {"Roughness": mean, "Anisotropic": stretch, "Anisotropic Rotation": 0, "Tangent": self.inputs.along(x, y)}


def unlit(graph, inputs, spec):
    """There for camera rays alone."""
    camera = graph.node("ShaderNodeLightPath").outputs["Is Camera Ray"]
    return graph.mix_shader(camera, transparent(graph), graph.node("ShaderNodeEmission", Color=inputs.color(spec["color"])))


def black(graph, inputs, spec):
    return None


SURFACES = {
    "diffuse": diffuse,
    "glossy": glossy,
    "glass": glass,
    "schlick_glass": schlick_glass,
    "principled": principled,
    "layered": layered,
    "specular_glossiness": specular_glossiness,
    "unlit": unlit,
    "black": black,
}


class Inputs:
    """What varies over the surface of one material; each is made once."""

    def __init__(self, graph, spec, images):
        self.graph, self.spec, self.images = graph, spec, images
        self.made = {}

    def once(self, key, make):
        if key not in self.made:
            self.made[key] = make()
        return self.made[key]

    def color(self, spec):
        color, graph = spec["factor"], self.graph
        if spec["texture"]:
            texel = self.texel(spec["texture"]).outputs["Color"]
            color = texel if color == [1, 1, 1] else graph.vector("MULTIPLY", texel, color)
        if spec["vertex"]:
            color = graph.vector("MULTIPLY", self.vertex_color().outputs["Color"], color)
        if spec["clamp"]:
            color = graph.vector("MAXIMUM", graph.vector("MINIMUM", color, (1, 1, 1)), (0, 0, 0))
        return color

    def value(self, spec):
        if not spec["texture"]:
            return spec["factor"]
        texel = self.texel(spec["texture"])
        if spec["channel"] == 3:
            value = texel.outputs["Alpha"]
        else:
            key = ("channels", texel.name)
            value = self.once(key, lambda: self.graph.split(texel.outputs["Color"]))[spec["channel"]]
        return value if spec["factor"] == 1 else self.graph.math("MULTIPLY", value, spec["factor"])

    def vertex_color(self):
        return self.once("color", lambda: self.graph.node("ShaderNodeVertexColor", layer_name="Color"))

    def texel(self, spec):
        def make():
            return self.graph.node(
                "ShaderNodeTexImage",
                image=self.images[spec["image"]],
                interpolation=spec["interpolation"],
                extension=spec["extension"],
                Vector=self.coordinates(spec),
            )

        return self.once(json.dumps(spec), make)

    def coordinates(self, spec):
        graph = self.graph
        if self.spec["sphere"]:
            uv = self.once("sphere", self.sphere_coordinates)
        else:
            name = f"UV{spec['uv_set']}"
            uv = self.once(name, lambda: graph.node("ShaderNodeUVMap", uv_map=name).outputs["UV"])
        if spec["transform"]:
            (a, c, e), (b, d, f) = spec["transform"]
            if b == c == 0:
                uv = graph.node("ShaderNodeMapping", Vector=uv, Scale=(a, d, 1), Location=(e, f, 0)).outputs["Vector"]
            else:
                u = graph.math("ADD", graph.vector("DOT_PRODUCT", uv, (a, c, 0)), e)
                uv = graph.join(u, graph.math("ADD", graph.vector("DOT_PRODUCT", uv, (b, d, 0)), f), 0)
        if spec["fold_u"] or spec["fold_v"]:
            u, v, _ = graph.split(uv)
            uv = graph.join(self.fold(u, spec["fold_u"]), self.fold(v, spec["fold_v"]), 0)
        return uv

    def fold(self, coordinate, spec):
        """Wraps one axis as the image node cannot, which has one way for both."""
        if not spec:
            return coordinate
        if spec["mirror"]:
            coordinate = self.graph.math("PINGPONG", coordinate, 1)
        edge = spec["half_texel"]
        return self.graph.math("MINIMUM", self.graph.math("MAXIMUM", coordinate, edge), 1 - edge)

    def outward(self):
        """Of a sphere; and −1 where it is seen from inside, which turns the normal round, else 1."""

        def make():
            geometry = self.graph.node("ShaderNodeNewGeometry")
            side = self.graph.math("MULTIPLY_ADD", geometry.outputs["Backfacing"], -2, 1)
            return self.graph.vector("SCALE", geometry.outputs["Normal"], side), side

        return self.once("outward", make)

    def sphere_coordinates(self):
        graph = self.graph
        x, y, z = graph.split(self.outward()[0])
        u = graph.math("MULTIPLY_ADD", graph.math("ARCTAN2", y, x), 0.5 / math.pi, 0.5)
        polar = graph.math("ARCCOSINE", graph.math("MINIMUM", graph.math("MAXIMUM", z, -1), 1))
        return graph.join(u, graph.math("MULTIPLY_ADD", polar, -1 / math.pi, 1), 0)

    def compass(self):
        """Of a sphere: where u and v grow."""

        def make():
            outward = self.outward()[0]
            east = self.graph.vector("NORMALIZE", self.graph.vector("CROSS_PRODUCT", (0, 0, 1), outward))
            return east, self.graph.vector("CROSS_PRODUCT", outward, east)

        return self.once("compass", make)

    def along(self, x, y):
        """The direction of these components along tangent and bitangent."""
        graph = self.graph
        if self.spec["sphere"]:
            tangent, bitangent = self.compass()
        else:
            tangent = graph.node("ShaderNodeTangent", direction_type="UV_MAP", uv_map="Given").outputs["Tangent"]
            geometry = graph.node("ShaderNodeNewGeometry")
            side = graph.math("MULTIPLY_ADD", geometry.outputs["Backfacing"], -2, 1)
            sign = graph.node("ShaderNodeAttribute", attribute_name="Given.tangent_sign").outputs["Fac"]
            bitangent = graph.vector("CROSS_PRODUCT", geometry.outputs["Normal"], tangent)
            bitangent = graph.vector("SCALE", bitangent, graph.math("MULTIPLY", side, sign))
        return graph.vector("ADD", graph.vector("SCALE", tangent, x), graph.vector("SCALE", bitangent, y))

    def by_angle(self, points):
        """A curve over √cos θ of the view."""
        graph = self.graph
        geometry = graph.node("ShaderNodeNewGeometry")
        cos = graph.vector("DOT_PRODUCT", self.normal() or geometry.outputs["Normal"], geometry.outputs["Incoming"])
        root = graph.math("SQRT", graph.math("ABSOLUTE", cos))
        node = graph.node("ShaderNodeFloatCurve", Value=root, Factor=1)
        curve = node.mapping.curves[0]
        while len(curve.points) < len(points):
            curve.points.new(0.5, 0.5)
        for i, y in enumerate(points):
            curve.points[i].location = (i / (len(points) - 1), y)
            curve.points[i].handle_type = "VECTOR"
        node.mapping.update()
        return node.outputs["Value"]

    def normal(self):
        spec = self.spec["normal"]
        return self.once("normal", lambda: self.make_normal(spec)) if spec else None

    def make_normal(self, spec):
        graph = self.graph
        texel, scale = self.texel(spec["texture"]).outputs["Color"], spec["scale"]
        if self.spec["sphere"]:
            outward, side = self.outward()
            x, y, z = graph.split(graph.vector("MULTIPLY_ADD", texel, (2 * scale, 2 * scale, 2), (-scale, -scale, -1)))
            east, north = self.compass()
            bent = graph.vector("SCALE", outward, z)
            for axis, share in ((east, x), (north, y)):
                bent = graph.vector("ADD", graph.vector("SCALE", axis, share), bent)
            return graph.vector("SCALE", graph.vector("NORMALIZE", bent), side)
        if scale != 1:
            shift = 0.5 - 0.5 * scale
            texel = graph.vector("MULTIPLY_ADD", texel, (scale, scale, 1), (shift, shift, 0))
        return graph.node("ShaderNodeNormalMap", space="TANGENT", uv_map="Given", Color=texel).outputs["Normal"]


def is_number(value, number=None):
    return isinstance(value, (int, float)) and (number is None or value == number)


class Graph:
    """Nodes. Where a value may stand, so may the output of a node, or a node, which stands for its first output."""

    def __init__(self, tree):
        self.tree = tree
        tree.nodes.clear()

    def node(self, kind, inputs=(), **settings):
        """Settings are of the node where it has them, else constants or links of its inputs."""
        node = self.tree.nodes.new(kind)
        for name, value in settings.items():
            if name[0].islower():
                setattr(node, name, value)
            else:
                self.feed(node.inputs[name], value)
        for name, value in dict(inputs).items():
            self.feed(node.inputs[name], value)
        return node

    def feed(self, socket, value):
        if value is None:
            return
        if isinstance(value, bpy.types.Node):
            value = value.outputs[0]
        if isinstance(value, bpy.types.NodeSocket):
            self.tree.links.new(value, socket)
        elif socket.type == "RGBA":
            socket.default_value = (*value, 1)
        else:
            socket.default_value = value

    def math(self, operation, *operands, clamp=False):
        return self.node("ShaderNodeMath", enumerate(operands), operation=operation, use_clamp=clamp).outputs[0]

    def vector(self, operation, *operands):
        inputs = dict(enumerate(operands))
        if operation == "SCALE":
            inputs = {0: operands[0], "Scale": operands[1]}
        node = self.node("ShaderNodeVectorMath", inputs, operation=operation)
        return node.outputs["Value" if operation == "DOT_PRODUCT" else "Vector"]

    def split(self, vector):
        return self.node("ShaderNodeSeparateXYZ", Vector=vector).outputs

    def join(self, x, y, z):
        return self.node("ShaderNodeCombineXYZ", X=x, Y=y, Z=z).outputs[0]

    def mix(self, share, a, b):
        """a + share (b − a), of colours."""
        difference = [q - p for p, q in zip(a, b)]
        return self.vector("MULTIPLY_ADD", self.join(share, share, share), difference, a)

    def mix_values(self, share, a, b):
        return self.math("MULTIPLY_ADD", self.math("SUBTRACT", b, a), share, a)

    def mix_shader(self, share, a, b):
        return self.node("ShaderNodeMixShader", {0: share, 1: a, 2: b})

    # Numbers stay numbers where all operands are.

    def times(self, a, b):
        for one, other in ((a, b), (b, a)):
            if is_number(one, 1):
                return other
        return a * b if is_number(a) and is_number(b) else self.math("MULTIPLY", a, b)

    def plus(self, a, b):
        return a + b if is_number(a) and is_number(b) else self.math("ADD", a, b)

    def rest(self, a):
        return 1 - a if is_number(a) else self.math("SUBTRACT", 1, a)

    def at_least(self, a, least):
        return max(a, least) if is_number(a) else self.math("MAXIMUM", a, least)

    def at_most(self, color, most):
        if isinstance(color, list):
            return [min(c, most) for c in color]
        return self.vector("MINIMUM", color, (most, most, most))

    def times_color(self, color, factor):
        """By a number or by a colour."""
        if is_number(factor, 1):
            return color
        if isinstance(color, list) and isinstance(factor, list):
            return [a * b for a, b in zip(color, factor)]
        if isinstance(color, list) and is_number(factor):
            return [a * factor for a in color]
        if is_number(factor):
            factor = (factor, factor, factor)
        return self.vector("MULTIPLY", color, factor)

    def blend(self, share, a, b):
        """Of shaders, of which only those needed have to be there."""
        return a if is_number(share, 0) else b if is_number(share, 1) else self.mix_shader(share, a, b)

    def finish(self, kind, shader, volume=None):
        output = self.node(kind)
        if shader is not None:
            self.feed(output.inputs["Surface"], shader)
        if volume is not None:
            self.feed(output.inputs["Volume"], volume)
        self.arrange(output)

    def arrange(self, output):
        """In columns, by the longest way to the output, for whoever opens the file."""
        depth = {output.name: 0}
        sources = {}
        for link in self.tree.links:
            sources.setdefault(link.to_node.name, []).append(link.from_node.name)
        waiting = [output.name]
        while waiting:
            name = waiting.pop()
            for source in sources.get(name, ()):
                if depth.get(source, -1) <= depth[name]:
                    depth[source] = depth[name] + 1
                    waiting.append(source)
        rows = {}
        for node in self.tree.nodes:
            column = depth.get(node.name, 0)
            node.location = (-240 * column, -320 * rows.setdefault(column, 0))
            rows[column] += 1


try:
    main()
except Exception:  # Blender would go on, and end with success
    traceback.print_exc()
    sys.exit(1)
