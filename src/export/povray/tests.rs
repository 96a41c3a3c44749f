//! Small worlds, and the lines they become.

use glam::{Affine2, Affine3A, Vec2, Vec3};

use super::*;
use crate::world::*;

fn world(surface: Surface) -> World {
    let camera = Camera {
        name: String::new(),
        node: String::new(),
        to_world: Affine3A::from_translation(Vec3::new(0.0, 0.0, 10.0)),
        projection: Projection::Orthographic { half_height: 1.0 },
        aperture: 0.0,
        focus: 1.0,
    };
    let environment =
        Environment { kind: EnvironmentKind::Color(Vec3::ZERO), strength: 1.0, rotation: 0.0, visible: true };
    let mut model = Model::default();
    model.materials.push(Material::new("it\" } #debug", surface));
    let spheres = vec![Sphere { center: Vec3::X, radius: 64.0, material: MaterialId(0) }];
    World { model, spheres, quads: vec![], environment, camera }
}

fn diffuse() -> Surface {
    Surface::Diffuse { color: ColorInput::constant(Vec3::new(0.25, 0.5, 0.75)) }
}

/// `scene.pov`, and the notes.
fn exported(world: &World) -> (String, Vec<crate::export::Note>) {
    let folder = tempfile::tempdir().expect("folder");
    let settings = Settings {
        bounces: Bounces { diffuse: 0, ..Bounces::uniform(4) },
        filter: crate::render::PixelFilter { kind: crate::render::FilterKind::Box, width: 1.0 },
        ..Settings::default()
    };
    let mut out = Folder::stage(folder.path()).expect("staged");
    let mut notes = Notes::default();
    write(world, &settings, &mut out, &mut notes).expect("written");
    out.publish().expect("published");
    (std::fs::read_to_string(folder.path().join("scene.pov")).expect("a scene"), notes.finish())
}

#[test]
fn names_stay_names() {
    let (scene, notes) = exported(&world(diffuse()));
    assert!(
        scene.contains(
            "#declare m_it_____debug = texture { pigment { rgb <0.25,0.5,0.75> } finish { diffuse 1.0 } }\n\
         sphere { <1.0,0.0,0.0>, 64.0 texture { m_it_____debug } }\n"
        ),
        "{scene}"
    );
    assert!(notes.is_empty(), "{notes:?}");
    assert!(scene.contains("max_trace_level 6 adc_bailout 1e-5"));
}

#[test]
fn glass_in_glass_is_told_against_nothing_and_casts_a_shadow() {
    let glass = |ior| Surface::Dielectric {
        ior,
        fresnel: Fresnel::Exact,
        roughness: ScalarInput::constant(0.0),
        tint: ColorInput::constant(Vec3::ONE),
    };
    let mut world = world(glass(1.5));
    world.model.materials.push(Material::new("air", glass(0.5)));
    world.spheres.push(Sphere { center: Vec3::X, radius: 8.0, material: MaterialId(1) });
    let (scene, notes) = exported(&world);
    assert!(scene.contains("interior { ior 1.5 } no_shadow }"), "{scene}");
    assert!(scene.contains("interior { ior 0.75 } no_shadow }"), "{scene}");
    assert_eq!(scene.matches("no_image no_reflection }").count(), 2);
    assert!(notes.is_empty(), "{notes:?}");
}

#[test]
fn a_texture_is_placed_by_the_inverse_of_its_lookup() {
    let mut world = world(diffuse());
    let image = Image { name: "i".into(), width: 1, height: 1, texels: Texels::Rgba8(vec![[1, 2, 3, 4]]) };
    world.model.images.push(image);
    world.model.textures.push(Texture {
        image: ImageId(0),
        color_space: ColorSpace::Srgb,
        wrap_u: Wrap::Repeat,
        wrap_v: Wrap::Repeat,
        filter: Filter::Linear,
    });
    let transform = Affine2::from_scale(Vec2::new(2.0, 4.0));
    let texture = TextureRef { texture: TextureId(0), uv_set: 0, transform };
    world.model.materials[0].surface =
        Surface::Diffuse { color: ColorInput { factor: Vec3::ONE, texture: Some(texture) } };
    world.spheres.clear();
    let quad = Quad {
        origin: Vec3::ZERO,
        u: 64.0 * Vec3::X,
        v: 64.0 * Vec3::Y,
        round: false,
        material: MaterialId(0),
    };
    world.quads.push(quad);
    let (scene, notes) = exported(&world);
    // v' = 1 − 4v, so v = ¼ − v' / 4
    let placed = "image_map { png \"textures/t_i.png\" gamma srgb interpolate 2 } matrix \
                  <0.5,0.0,0.0,0.0,-0.25,0.0,0.0,0.0,1.0,0.0,0.25,0.0>";
    assert!(scene.contains(placed), "{scene}");
    assert!(scene.contains("uv_mapping texture { m_it"), "{scene}");
    assert!(notes.is_empty(), "{notes:?}");
}

#[test]
fn nothing_is_silent() {
    let mut world = world(diffuse());
    world.environment.kind = EnvironmentKind::Color(Vec3::ONE);
    let said = |world: &World| exported(world).1.iter().map(|n| n.to_string()).collect::<String>();
    assert!(said(&world).contains("128 distant lights"));
    world.model.materials[0].surface =
        Surface::Metal { color: ColorInput::constant(Vec3::ONE), finish: MetalFinish::Fuzz(0.5) };
    let text = said(&world);
    assert!(text.contains("its fuzz") && !text.contains("distant lights"), "{text}");
}
