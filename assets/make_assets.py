#!/usr/bin/env python3
"""Makes the models and the sky in this folder: geometry, textures and light are computed, Blender's exporters write.

usage: python make_assets.py        (PyPI `bpy` 5.0; numpy comes with it)

| file | what |
|---|---|
| tea-jar.glb | ceramic and brass tea jar: base colour, metallic-roughness and normal textures inside |
| tea-jar.gltf, .bin, tea-jar-*.png | the same, in parts |
| fruit-bowl.obj, .mtl, pear.png, celadon.png, oak.png | three pears in a fluted bowl on a round board |
| studio-sky.hdr | evening sky with a soft sun: 512 x 256, equirectangular, scene-linear Rec.709 |

The same numbers come out each time: every random draw has its seed.
"""
import os
import sys

import bpy

sys.dont_write_bytecode = True
from making.fruit_bowl import bowl_mesh, board_mesh, celadon_texture, oak_texture, pear_mesh, pear_texture
from making.images import FOLDER
from making.shaders import plain_material, textured_material
from making.sky import sky
from making.tea_jar import jar_mesh, jar_textures


def main():
    bpy.ops.wm.read_factory_settings(use_empty=True)
    sky()
    jar = jar_mesh(textured_material("Jar", *jar_textures()))
    select(jar)
    options = dict(use_selection=True, export_apply=True, export_yup=True, export_animations=False)
    bpy.ops.export_scene.gltf(filepath=os.path.join(FOLDER, "tea-jar.glb"), export_format="GLB", **options)
    bpy.ops.export_scene.gltf(filepath=os.path.join(FOLDER, "tea-jar.gltf"), export_format="GLTF_SEPARATE",
                              export_keep_originals=True, **options)

    pear = [plain_material("Pear", (1, 1, 1), .38, pear_texture()), plain_material("Stem", (.11, .06, .025), .8)]
    things = [bowl_mesh(plain_material("Celadon", (1, 1, 1), .12, celadon_texture()))]
    things.append(pear_mesh("Pear 1", pear, (-2.9, -1.6, 5.9), 24, 20, 1.0, 31))
    things.append(pear_mesh("Pear 2", pear, (3.2, -1.2, 5.7), 62, 118, .95, 32))
    things.append(pear_mesh("Pear 3", pear, (.2, 3.3, 6.0), -18, 200, 1.03, 33))
    things.append(board_mesh(plain_material("Oak", (1, 1, 1), .45, oak_texture())))
    select(*things)
    bpy.ops.wm.obj_export(filepath=os.path.join(FOLDER, "fruit-bowl.obj"), export_selected_objects=True, path_mode="RELATIVE",
                          export_normals=True, export_uv=True, export_materials=True, export_smooth_groups=False)


def select(*things):
    bpy.ops.object.select_all(action="DESELECT")
    for thing in things:
        thing.select_set(True)


if __name__ == "__main__":
    main()
