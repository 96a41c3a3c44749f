"""Materials as Blender's exporters understand them."""
import bpy


def textured_material(name, base, metal_rough, normal):
    material = bpy.data.materials.new(name)
    tree = material.node_tree
    shader = tree.nodes["Principled BSDF"]

    def image(path, space):
        node = tree.nodes.new("ShaderNodeTexImage")
        node.image = bpy.data.images.load(path)
        node.image.colorspace_settings.name = space
        return node.outputs["Color"]

    tree.links.new(image(base, "sRGB"), shader.inputs["Base Color"])
    split = tree.nodes.new("ShaderNodeSeparateColor")
    tree.links.new(image(metal_rough, "Non-Color"), split.inputs["Color"])
    tree.links.new(split.outputs["Green"], shader.inputs["Roughness"])
    tree.links.new(split.outputs["Blue"], shader.inputs["Metallic"])
    bend = tree.nodes.new("ShaderNodeNormalMap")
    tree.links.new(image(normal, "Non-Color"), bend.inputs["Color"])
    tree.links.new(bend.outputs["Normal"], shader.inputs["Normal"])
    return material


def plain_material(name, color, roughness, texture=None):
    material = bpy.data.materials.new(name)
    shader = material.node_tree.nodes["Principled BSDF"]
    shader.inputs["Base Color"].default_value = (*color, 1)
    shader.inputs["Roughness"].default_value = roughness
    if texture:
        node = material.node_tree.nodes.new("ShaderNodeTexImage")
        node.image = bpy.data.images.load(texture)
        material.node_tree.links.new(node.outputs["Color"], shader.inputs["Base Color"])
    return material
