use glam::Affine2;

use super::*;
use crate::{
    diagnostic::render,
    scene::parse,
    world::{ColorInput, Filter, Light, MaterialId, Mesh, MeshId, Texels, TextureId, TextureRef, Wrap},
};

/// A triangle of a textured material called "Paint", a light, a camera called "Cam".
fn asset(path: &Path, _: &Selection) -> Result<Model, Vec<Diagnostic>> {
    if std::fs::read_to_string(path).is_ok_and(|text| text == "broken") {
        return Err(vec![Diagnostic::error(path, Place::Pointer("/meshes/0".into()), "is broken")]);
    }
    let texture = TextureRef { texture: TextureId(0), uv_set: 0, transform: Affine2::IDENTITY };
    let color = ColorInput { factor: Vec3::ONE, texture: Some(texture) };
    Ok(Model {
        meshes: vec![Mesh {
            positions: vec![Vec3::ZERO, Vec3::X, Vec3::Y],
            triangles: vec![[0, 1, 2]],
            ..Mesh::default()
        }],
        images: vec![picture(path).expect("is read")],
        textures: vec![Texture {
            image: ImageId(0),
            color_space: ColorSpace::Srgb,
            wrap_u: Wrap::Repeat,
            wrap_v: Wrap::Repeat,
            filter: Filter::Linear,
        }],
        materials: vec![Material::new("Paint", Surface::Diffuse { color })],
        instances: vec![Instance {
            name: "triangle".into(),
            mesh: MeshId(0),
            to_world: Affine3A::IDENTITY,
            materials: vec![MaterialId(0)],
        }],
        lights: vec![Light::Point { position: Vec3::X, intensity: Vec3::ONE }],
        cameras: vec![Camera {
            name: "Cam".into(),
            node: "Stand".into(),
            to_world: Affine3A::from_translation(5.0 * Vec3::Z),
            projection: Projection::Perspective { vfov: 1.0 },
            aperture: 0.0,
            focus: 1.0,
        }],
        environment: path.ends_with("b.glb").then_some(Environment {
            kind: EnvironmentKind::Image { image: ImageId(0), color_space: ColorSpace::Linear },
            strength: 3.0,
            rotation: 0.0,
            visible: true,
        }),
        warnings: Vec::new(),
        sources: Vec::new(),
    })
}

fn picture(path: &Path) -> Result<Image, Diagnostic> {
    match path.extension() {
        Some(extension) if extension == "jpg" => Err(Diagnostic::error(path, Place::File, "does not decode")),
        _ => Ok(Image { name: "i".into(), width: 1, height: 1, texels: Texels::Rgba8(vec![[0; 4]]) }),
    }
}

fn build(text: &str) -> Result<World, Vec<Diagnostic>> {
    let folder = tempfile::tempdir().expect("a folder");
    for (name, text) in [("a.glb", ""), ("b.glb", ""), ("bad.obj", "broken"), ("i.png", ""), ("i.jpg", "")] {
        std::fs::write(folder.path().join(name), text).expect("a file");
    }
    let scene = parse(text, &folder.path().join("scene.toml"));
    let scene = scene.unwrap_or_else(|errors| panic!("{}", render(&errors, false)));
    let model = |source: &ModelSource, _: &[&Material]| Ok((asset(&source.file, &source.selection)?, ()));
    assemble_with(model, picture, scene).map(|assembled| assembled.world)
}

#[test]
fn a_file_is_loaded_once_and_placed_often() {
    let world = build(
        r#"
        [materials.gold]
        type = "metal"
        color = { image = "i.png" }
        [materials.lit]
        type = "diffuse"
        color = { image = "i.png", wrap = "clamp" }
        [[model]]
        file = "a.glb"
        [[model]]
        file = "./a.glb"
        translate = [10, 0, 0]
        scale = -2
        materials = { Paint = "lit" }
        [[model]]
        file = "b.glb"
        "#,
    )
    .expect("is good");
    let model = &world.model;
    // Two assets, and one image for both textures of the scene file.
    assert_eq!((model.meshes.len(), model.images.len(), model.textures.len()), (2, 3, 4));
    assert_eq!((model.materials.len(), model.instances.len(), model.lights.len()), (4, 3, 3));
    let material = |i: usize| &model.materials[model.instances[i].materials[0].index()];
    assert_eq!([0, 1, 2].map(|i| material(i).name.as_str()), ["Paint", "lit", "Paint"]);
    assert_eq!(model.instances.iter().map(|i| i.mesh.0).collect::<Vec<_>>(), [0, 0, 1]);
    // Handles of the second asset's material lead to its own image.
    let Surface::Diffuse { color } = material(2).surface else { panic!("is diffuse") };
    let texture = model.textures[color.texture.expect("is textured").texture.index()];
    assert_eq!(texture.image, ImageId(2));
    // The light goes with its model, and is as strong.
    assert_eq!(model.lights[1], Light::Point { position: Vec3::new(8.0, 0.0, 0.0), intensity: Vec3::ONE });
}

#[test]
fn each_moment_of_a_file_is_a_model_of_its_own() {
    let world = build(
        "[[model]]\nfile = \"a.glb\"\nat = 1\n[[model]]\nfile = \"a.glb\"\nat = 2\n[[model]]\nfile = \"a.glb\"\nat = 1\n",
    );
    assert_eq!(world.expect("is good").model.meshes.len(), 2);
}

#[test]
fn the_surrounding_of_a_model_yields_to_that_of_the_scene() {
    let models = "[[model]]\nfile = \"a.glb\"\n[[model]]\nfile = \"b.glb\"\n";
    let environment = build(models).expect("is good").environment;
    // The image of the second asset.
    let kind = EnvironmentKind::Image { image: ImageId(1), color_space: ColorSpace::Linear };
    assert_eq!((environment.kind, environment.strength), (kind, 3.0));
    let own = build(&format!("[environment]\ntype = \"color\"\n{models}")).expect("is good").environment;
    assert_eq!(own.kind, EnvironmentKind::Color(Vec3::ONE));
}

#[test]
fn a_camera_is_called_by_its_name_or_its_nodes() {
    for name in ["Cam", "Stand"] {
        let text = format!("[camera]\nimported = \"{name}\"\n[[model]]\nfile = \"a.glb\"\n");
        assert_eq!(build(&text).expect("is good").camera.name, "Cam");
    }
}

#[test]
fn cameras_of_models() {
    let world = build(
        "[[model]]\nfile = \"a.glb\"\nscale = 3\nrotate = [0, 90, 0]\n[camera]\nimported = \"Cam\"\nfstop = 2\n",
    );
    let camera = world.expect("is good").camera;
    let at = camera.to_world.translation;
    assert!(at.abs_diff_eq(glam::Vec3A::new(15.0, 0.0, 0.0), 1e-4), "{at}");
    assert!((camera.to_world.matrix3.determinant() - 1.0).abs() < 1e-5, "no scale is left");
    assert!((camera.focus - 15.0).abs() < 1.6 && camera.aperture > 0.0, "{camera:?}");
}

#[test]
fn all_that_is_wrong_with_the_files_is_told() {
    let errors = build(
        r#"
        [camera]
        imported = "Can"
        [environment]
        type = "image"
        file = "i.jpg"
        [materials.a]
        type = "diffuse"
        [[model]]
        file = "bad.obj"
        [[model]]
        file = "bad.obj"
        [[model]]
        file = "a.glb"
        materials = { Pain = "a" }
        "#,
    )
    .expect_err("is wrong");
    let shown = render(&errors, false);
    for part in ["does not decode", "bad.obj#/meshes/0", "did you mean `Paint`?"] {
        assert!(shown.contains(part), "{part} is not in\n{shown}");
    }
    assert_eq!(errors.len(), 3, "{shown}");
    // The camera may be in the model that could not be loaded; otherwise it is missed.
    let errors = build("[camera]\nimported = \"Can\"\n[[model]]\nfile = \"a.glb\"\n").expect_err("is wrong");
    assert!(render(&errors, false).contains("did you mean `Cam`?"));
}

#[test]
fn darkness_is_warned_of() {
    let dark = build("[materials.a]\ntype = \"diffuse\"\n[[sphere]]\nmaterial = \"a\"\n").expect("is good");
    assert_eq!(dark.model.warnings.len(), 1);
    let lit = build("[environment]\ntype = \"color\"\n").expect("is good");
    assert!(lit.model.warnings.is_empty());
}
