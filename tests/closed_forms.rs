//! Scenes whose radiance is known in closed form: a factor of π, a lost cosine or light counted twice shows here.

use std::f32::consts::PI;

use glam::{Affine2, Affine3A, Mat3, Vec2, Vec3};
use rayo::{
    compile::compile,
    integrator::{RayCounts, Rims, sample_pixel, trace_lamp_path},
    light::SAMPLES_A_LAMP_PATH,
    render::{Bounces, FilterKind, PixelFilter, Settings},
    world::*,
};

struct Stage {
    world: World,
    bounces: u32,
}

impl Stage {
    /// Looks from `position` at `target`; black all round until something is added.
    fn new(position: Vec3, target: Vec3) -> Self {
        let z = (position - target).normalize();
        let x = z.any_orthonormal_vector();
        let camera = Camera {
            name: String::new(),
            node: String::new(),
            to_world: Affine3A::from_mat3_translation(Mat3::from_cols(x, z.cross(x), z), position),
            projection: Projection::Perspective { vfov: 1e-3 },
            aperture: 0.0,
            focus: 1.0,
        };
        let environment = Environment {
            kind: EnvironmentKind::Color(Vec3::ZERO),
            strength: 1.0,
            rotation: 0.0,
            visible: true,
        };
        let world = World { model: Model::default(), spheres: vec![], quads: vec![], environment, camera };
        Self { world, bounces: 64 }
    }

    /// Looks straight down on the origin.
    fn from_above(height: f32) -> Self {
        Self::new(Vec3::new(0.0, height, 0.0), Vec3::ZERO)
    }

    fn sky(mut self, radiance: f32) -> Self {
        self.world.environment.kind = EnvironmentKind::Color(Vec3::splat(radiance));
        self
    }

    fn light(mut self, light: Light) -> Self {
        self.world.model.lights.push(light);
        self
    }

    fn material(&mut self, material: Material) -> MaterialId {
        self.world.model.materials.push(material);
        MaterialId(self.world.model.materials.len() as u32 - 1)
    }

    fn sphere(mut self, center: Vec3, radius: f32, material: Material) -> Self {
        let material = self.material(material);
        self.world.spheres.push(Sphere { center, radius, material });
        self
    }

    /// A square of side 2 × `half` about `center`, facing `normal`.
    fn square(mut self, center: Vec3, normal: Vec3, half: f32, material: Material) -> Self {
        let material = self.material(material);
        let u = normal.normalize().any_orthonormal_vector();
        let v = normal.normalize().cross(u);
        let origin = center - half * (u + v);
        self.world.quads.push(Quad { origin, u: 2.0 * half * u, v: 2.0 * half * v, round: false, material });
        self
    }

    /// Makes the last square round.
    fn round(mut self) -> Self {
        self.world.quads.last_mut().expect("a square").round = true;
        self
    }

    fn bounces(mut self, bounces: u32) -> Self {
        self.bounces = bounces;
        self
    }

    /// Mean of the middle pixel over `samples`, and its standard error.
    fn radiance(self, samples: u32) -> (f64, f64) {
        let settings = Settings {
            size: [1, 1],
            bounces: Bounces::uniform(self.bounces),
            filter: PixelFilter { kind: FilterKind::Box, width: 1.0 },
            seed: 11,
            ..Settings::default()
        };
        let scene = compile(self.world, &settings);
        let mut counts = RayCounts::default();
        // With some paths from the camera goes one from a lamp, where lamps are focused.
        let mut splats = Vec::new();
        let mut sample = |i: u32| {
            splats.clear();
            if i.is_multiple_of(SAMPLES_A_LAMP_PATH) {
                trace_lamp_path(&scene, [0, 0], i / SAMPLES_A_LAMP_PATH, &mut counts, &mut splats);
            }
            let brought =
                SAMPLES_A_LAMP_PATH as f32 * splats.iter().map(|splat| splat.radiance).sum::<Vec3>();
            f64::from((sample_pixel(&scene, &Rims::NONE, [0, 0], i, &mut counts) + brought).y)
        };
        let values: Vec<f64> = (0..samples).map(&mut sample).collect();
        let n = values.len() as f64;
        let mean = values.iter().sum::<f64>() / n;
        let variance = values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / n;
        (mean, (variance / n).sqrt())
    }

    #[track_caller]
    fn expect(self, samples: u32, expected: f32) {
        let (mean, error) = self.radiance(samples);
        let tolerance = 4.0 * error + 1e-4 * expected as f64 + 1e-6;
        assert!((mean - expected as f64).abs() <= tolerance, "{mean} ± {error}, expected {expected}");
        assert!(error <= 0.02 * expected.abs() as f64 + 1e-6, "too noisy to tell: {mean} ± {error}");
    }
}

fn diffuse(albedo: f32) -> Material {
    Material::new("", Surface::Diffuse { color: ColorInput::constant(Vec3::splat(albedo)) })
}

fn glass(ior: f32, roughness: f32) -> Material {
    Material::new(
        "",
        Surface::Dielectric {
            ior,
            fresnel: Fresnel::Exact,
            roughness: ScalarInput::constant(roughness),
            tint: ColorInput::constant(Vec3::ONE),
        },
    )
}

fn pbr(base: f32, metallic: f32, roughness: f32) -> Material {
    Material::new(
        "",
        Surface::Pbr(Pbr {
            base_color: ColorInput::constant(Vec3::splat(base)),
            metallic: ScalarInput::constant(metallic),
            roughness: ScalarInput::constant(roughness),
            ior: 1.5,
            multiscatter: true,
        }),
    )
}

fn metal(tint: f32, finish: MetalFinish) -> Material {
    Material::new("", Surface::Metal { color: ColorInput::constant(Vec3::splat(tint)), finish })
}

fn shining(mut material: Material, radiance: f32, two_sided: bool) -> Material {
    let color = ColorInput::constant(Vec3::splat(radiance));
    material.emission = Some(Emission { color, strength: 1.0, two_sided });
    material
}

fn lamp(radiance: f32) -> Material {
    shining(Material::new("", Surface::Black), radiance, false)
}

#[test]
fn inside_a_glowing_sphere_radiance_is_a_geometric_series() {
    // L = e + ρ L
    let inside = || Stage::new(Vec3::new(0.2, 0.1, 0.0), Vec3::X);
    inside().sphere(Vec3::ZERO, 1.0, shining(diffuse(0.5), 1.0, true)).expect(262144, 2.0);
    inside().sphere(Vec3::ZERO, 1.0, shining(diffuse(0.0), 3.0, true)).expect(16, 3.0);
    inside().sphere(Vec3::ZERO, 1.0, shining(diffuse(0.5), 1.0, true)).bounces(1).expect(1024, 1.75);
}

#[test]
fn a_one_sided_lamp_is_black_from_behind() {
    let look = |side: f32| Stage::from_above(2.0 * side).square(Vec3::ZERO, Vec3::Y, 1.0, lamp(2.0));
    look(1.0).expect(16, 2.0);
    look(-1.0).expect(16, 0.0);
}

#[test]
fn furnace_every_material_under_a_white_sky() {
    let rough = |roughness| MetalFinish::Roughness {
        roughness: ScalarInput::constant(roughness),
        fresnel: Fresnel::Schlick,
        multiscatter: true,
    };
    let materials = [
        diffuse(1.0),
        metal(1.0, MetalFinish::Fuzz(0.0)),
        metal(1.0, rough(0.2)),
        metal(1.0, rough(1.0)),
        pbr(1.0, 0.0, 0.0),
        pbr(1.0, 0.0, 0.5),
        pbr(1.0, 1.0, 1.0),
        pbr(1.0, 0.5, 0.3),
        glass(1.5, 0.0),
        glass(1.5, 0.4),
        glass(1.0 / 1.5, 0.0),
    ];
    for material in materials {
        let name = format!("{:?}", material.surface);
        let (mean, error) = Stage::new(Vec3::new(0.3, 0.4, 5.0), Vec3::new(0.3, 0.4, 0.0))
            .sky(1.0)
            .sphere(Vec3::ZERO, 1.0, material)
            .bounces(1000)
            .radiance(8192);
        assert!((mean - 1.0).abs() < 0.005 + 3.0 * error, "{name}: {mean} ± {error}");
        assert!(error < 0.01, "{name}: {mean} ± {error}");
    }
}

#[test]
fn furnace_with_a_bubble_in_the_glass() {
    Stage::new(Vec3::new(0.1, 0.2, 5.0), Vec3::new(0.1, 0.2, 0.0))
        .sky(1.0)
        .sphere(Vec3::ZERO, 1.0, glass(1.5, 0.0))
        .sphere(Vec3::ZERO, 0.8, glass(1.0 / 1.5, 0.0))
        .bounces(1000)
        .expect(1024, 1.0);
}

#[test]
fn a_point_light_falls_off_with_the_square_of_distance() {
    for h in [1.0, 3.0] {
        Stage::from_above(5.0)
            .square(Vec3::ZERO, Vec3::Y, 1.0, diffuse(0.5))
            .light(Light::Point { position: Vec3::new(h, h, 0.0), intensity: Vec3::splat(10.0) })
            .expect(16, 0.5 / PI * 10.0 * 0.5f32.sqrt() / (2.0 * h * h));
    }
}

#[test]
fn a_sun_gives_its_irradiance_whatever_its_size() {
    for angle in [0.0, 0.00925, 0.3] {
        let direction = Vec3::new(-1.0, -1.0, 0.0).normalize();
        Stage::from_above(5.0)
            .square(Vec3::ZERO, Vec3::Y, 1.0, diffuse(0.8))
            .light(Light::Sun { direction, irradiance: Vec3::splat(3.0), angle })
            .expect(4096, 0.8 / PI * 3.0 * 0.5f32.sqrt());
    }
}

#[test]
fn a_spot_lights_its_cone_and_nothing_else() {
    let lit = |inner: f32, outer: f32| {
        Stage::from_above(5.0).square(Vec3::ZERO, Vec3::Y, 1.0, diffuse(1.0)).light(Light::Spot {
            position: Vec3::new(0.0, 2.0, 0.0),
            direction: Vec3::new(0.5, -1.0, 0.0).normalize(),
            intensity: Vec3::splat(4.0),
            inner,
            outer,
        })
    };
    let off_axis = 0.5f32.atan();
    lit(off_axis + 0.1, off_axis + 0.2).expect(16, 1.0 / PI);
    lit(0.1, off_axis - 0.05).expect(16, 0.0);
    let (inner, outer) = (0.1f32, 0.9f32);
    let falloff = (off_axis.cos() - outer.cos()) / (inner.cos() - outer.cos());
    lit(inner, outer).expect(16, falloff * falloff / PI);
}

#[test]
fn a_disk_lamp_has_the_form_factor_of_a_disk() {
    // E = π L r² / (r² + h²) under the centre of a parallel disk
    let (h, r, radiance) = (1.0f32, 1.5f32, 2.0f32);
    Stage::from_above(0.9 * h)
        .square(Vec3::ZERO, Vec3::Y, 0.1, diffuse(0.6))
        .square(Vec3::new(0.0, h, 0.0), Vec3::NEG_Y, r, lamp(radiance))
        .round()
        .expect(8192, 0.6 * radiance * r * r / (r * r + h * h));
}

#[test]
fn a_sphere_lamp_shines_like_the_square_of_the_sine_of_its_half_angle() {
    let (d, r, radiance) = (3.0f32, 0.5f32, 5.0f32);
    let position = d * Vec3::new(1.0, 1.0, 0.0).normalize();
    Stage::from_above(5.0)
        .square(Vec3::ZERO, Vec3::Y, 0.1, diffuse(0.7))
        .sphere(position, r, lamp(radiance))
        .expect(4096, 0.7 * radiance * (r / d).powi(2) * 0.5f32.sqrt());
}

#[test]
fn a_mirror_shows_the_lamp_times_its_tint() {
    Stage::new(Vec3::new(-2.0, 2.0, 0.0), Vec3::ZERO)
        .square(Vec3::ZERO, Vec3::Y, 1.0, metal(0.8, MetalFinish::Fuzz(0.0)))
        .square(Vec3::new(3.0, 3.0, 0.0), Vec3::new(-1.0, -1.0, 0.0), 1.0, lamp(2.0))
        .expect(64, 1.6);
}

#[test]
fn blended_surfaces_cover_their_share_of_light_and_view() {
    let veiled = |mut material: Material| {
        material.alpha = Alpha::Blend;
        material.coverage = ScalarInput::constant(0.25);
        material
    };
    // seen: a quarter of the veil, three quarters of the sky behind it
    Stage::from_above(5.0).sky(2.0).square(Vec3::ZERO, Vec3::Y, 1.0, veiled(lamp(1.0))).expect(4096, 1.75);
    // in the way of a light: three quarters of it get through
    Stage::new(Vec3::new(2.0, 2.0, 0.0), Vec3::ZERO)
        .square(Vec3::ZERO, Vec3::Y, 0.5, diffuse(1.0))
        .square(Vec3::new(0.0, 1.0, 0.0), Vec3::Y, 0.5, veiled(diffuse(0.0)))
        .light(Light::Point { position: Vec3::new(0.0, 2.0, 0.0), intensity: Vec3::splat(4.0) })
        .expect(16, 0.75 / PI);
}

#[test]
fn a_lamp_that_covers_a_quarter_gives_a_quarter_of_its_light() {
    let mut veiled = lamp(2.0);
    veiled.alpha = Alpha::Blend;
    veiled.coverage = ScalarInput::constant(0.25);
    // under the centre of a parallel disk, as above
    Stage::from_above(0.9)
        .square(Vec3::ZERO, Vec3::Y, 0.1, diffuse(0.6))
        .square(Vec3::Y, Vec3::NEG_Y, 1.5, veiled)
        .round()
        .expect(16384, 0.25 * 0.6 * 2.0 * 2.25 / 3.25);
}

#[test]
fn masked_surfaces_are_there_or_not() {
    for (coverage, expected) in [(0.49, 1.0), (0.51, 0.0)] {
        let mut hole = metal(0.0, MetalFinish::Fuzz(0.0));
        hole.alpha = Alpha::Mask { cutoff: 0.5 };
        hole.coverage = ScalarInput::constant(coverage);
        Stage::from_above(5.0).sky(1.0).square(Vec3::ZERO, Vec3::Y, 1.0, hole).expect(16, expected);
    }
}

#[test]
fn single_sided_surfaces_hide_from_the_camera_but_still_cast_shadows() {
    let single = || Material { double_sided: false, ..diffuse(0.0) };
    // the camera looks through the back of a roof
    Stage::from_above(5.0).sky(1.0).square(Vec3::ZERO, Vec3::NEG_Y, 1.0, single()).expect(16, 1.0);
    // but light does not pass it
    Stage::new(Vec3::new(2.0, 2.0, 0.0), Vec3::ZERO)
        .square(Vec3::ZERO, Vec3::Y, 0.5, diffuse(1.0))
        .square(Vec3::new(0.0, 1.0, 0.0), Vec3::NEG_Y, 0.5, single())
        .light(Light::Point { position: Vec3::new(0.0, 2.0, 0.0), intensity: Vec3::splat(4.0) })
        .expect(16, 0.0);
}

#[test]
fn unlit_surfaces_show_their_colour_and_cast_nothing() {
    let unlit = || Material::new("", Surface::Unlit { color: ColorInput::constant(Vec3::splat(0.3)) });
    Stage::from_above(5.0).sky(1.0).square(Vec3::ZERO, Vec3::Y, 1.0, unlit()).expect(16, 0.3);
    Stage::new(Vec3::new(2.0, 2.0, 0.0), Vec3::ZERO)
        .square(Vec3::ZERO, Vec3::Y, 0.5, diffuse(1.0))
        .square(Vec3::new(0.0, 1.0, 0.0), Vec3::Y, 0.5, unlit())
        .light(Light::Point { position: Vec3::new(0.0, 2.0, 0.0), intensity: Vec3::splat(4.0) })
        .expect(16, 1.0 / PI);
}

/// Flat meshes in coordinate planes: rays that leave a triangle must not meet its neighbours in the same plane.
#[test]
fn a_flat_mesh_under_a_white_sky_reflects_its_albedo() {
    for normal in [Vec3::Y, Vec3::NEG_X, Vec3::Z, Vec3::new(1.0, 2.0, -0.5).normalize()] {
        for shift in [Vec3::ZERO, Vec3::new(0.3, 0.0, 7.1)] {
            let (u, v) = normal.any_orthonormal_pair();
            let positions = vec![Vec3::ZERO, 50.0 * u, -40.0 * v, -0.01 * u, 0.02 * v];
            let triangles = vec![[0, 1, 2], [0, 2, 3], [0, 3, 4], [0, 4, 1]];
            let mut stage = Stage::new(shift + 5.0 * normal, shift + 0.001 * (u + v)).sky(1.0);
            let material = stage.material(diffuse(0.5));
            stage.world.model.meshes.push(Mesh { positions, triangles, ..Mesh::default() });
            stage.world.model.instances.push(Instance {
                name: String::new(),
                mesh: MeshId(0),
                to_world: Affine3A::from_translation(shift),
                materials: vec![material],
            });
            stage.expect(1024, 0.5);
        }
    }
}

/// The texture's right half is white: seen from outside with +Y up, so is the right half of the ball.
#[test]
fn a_texture_reads_the_right_way_round_on_a_sphere() {
    for (x, expected) in [(-0.5, 0.2), (0.5, 1.0)] {
        let mut stage = Stage::new(Vec3::new(x, 0.0, 5.0), Vec3::new(x, 0.0, 0.0));
        let texels = Texels::Rgba8(vec![[51, 51, 51, 255], [255; 4]]);
        // +Z is at u = ¼, so that the picture's middle third shows there
        stage.world.model.images.push(Image { name: String::new(), width: 2, height: 1, texels });
        stage.world.model.textures.push(Texture {
            image: ImageId(0),
            color_space: ColorSpace::Linear,
            wrap_u: Wrap::Repeat,
            wrap_v: Wrap::Repeat,
            filter: Filter::Nearest,
        });
        let transform = Affine2::from_translation(Vec2::new(0.25, 0.0));
        let texture = Some(TextureRef { texture: TextureId(0), uv_set: 0, transform });
        let color = ColorInput { factor: Vec3::ONE, texture };
        let mut material = Material::new("", Surface::Black);
        material.emission = Some(Emission { color, strength: 1.0, two_sided: false });
        stage.sphere(Vec3::ZERO, 1.0, material).expect(16, expected);
    }
}

/// White dielectric of this index that lets all pass that it does not reflect.
fn clear(ior: f32) -> Layered {
    let pbr = Pbr {
        base_color: ColorInput::constant(Vec3::ONE),
        metallic: ScalarInput::constant(0.0),
        roughness: ScalarInput::constant(0.0),
        ior,
        multiscatter: true,
    };
    Layered { transmission: Some(ScalarInput::constant(1.0)), ..Layered::new(pbr) }
}

/// A medium that leaves half of the light after `distance`, in a boundary that does nothing else.
fn fog(distance: f32) -> Material {
    let volume = Volume { attenuation_color: Vec3::splat(0.5), attenuation_distance: distance };
    layers(Layered { volume: Some(volume), ..clear(1.0) })
}

fn layers(layered: Layered) -> Material {
    Material::new("layers", Surface::Layered(Box::new(layered)))
}

#[test]
fn a_medium_absorbs_by_beer() {
    // straight through the middle of a sphere: half per metre, over three metres
    Stage::new(Vec3::new(0.0, 0.0, 9.0), Vec3::ZERO)
        .sky(8.0)
        .sphere(Vec3::ZERO, 1.5, fog(1.0))
        .expect(64, 1.0);
    // with a camera inside, two metres from the far side
    Stage::new(Vec3::Z, Vec3::ZERO).sky(4.0).sphere(Vec3::ZERO, 1.0, fog(1.0)).expect(64, 1.0);
}

#[test]
fn a_medium_inside_another_displaces_it() {
    // halved every 10 m outside and every 5 m inside, over 1 m, 2 m and 1 m: 2^(−0.1 − 0.4 − 0.1)
    let stage = Stage::new(Vec3::new(0.0, 0.0, 9.0), Vec3::ZERO).sky(1.0);
    let stage = stage.sphere(Vec3::ZERO, 2.0, fog(10.0)).sphere(Vec3::ZERO, 1.0, fog(5.0));
    stage.expect(1 << 14, 0.659_754);
}

#[test]
fn light_fades_between_things_inside_a_medium() {
    // A lamp of 1 W/sr, 1 m above a white plane, seen through 3 m of the fog: 1/π × ½ × ⅛
    let lamp = Light::Point { position: Vec3::Y, intensity: Vec3::ONE };
    let white = Surface::Diffuse { color: ColorInput::constant(Vec3::ONE) };
    Stage::from_above(10.0)
        .bounces(1)
        .light(lamp)
        .square(Vec3::ZERO, Vec3::Y, 0.1, Material::new("white", white))
        .sphere(Vec3::ZERO, 3.0, fog(1.0))
        .expect(64, 1.0 / PI / 16.0);
}

#[test]
fn a_thin_wall_reflects_and_passes_straight() {
    // head-on at 1.5: 0.04 of the sky in front, the rest tinted by 0.5 from behind
    let mut wall = clear(1.5);
    wall.pbr.base_color = ColorInput::constant(Vec3::splat(0.5));
    let expected = 0.04 + 0.96 * 0.5;
    let (mean, error) =
        Stage::from_above(3.0).sky(1.0).square(Vec3::ZERO, Vec3::Y, 1.0, layers(wall)).radiance(4096);
    assert!((mean - expected).abs() < 4.0 * error + 2e-3, "{mean} ± {error}");
}

#[test]
fn thin_walls_let_the_light_of_lamps_through() {
    // A sun of 1 W/m² straight above a white floor, under two walls of 0.96 × 0.5 each, seen from below them: 0.48²/π. The
    // same of a bright sky: what is seen by chance and what is chosen must not add up to more.
    let mut wall = clear(1.5);
    wall.pbr.base_color = ColorInput::constant(Vec3::splat(0.5));
    let wall = |stage: Stage, y: f32| stage.square(Vec3::Y * y, Vec3::Y, 1000.0, layers(wall));
    let white = Surface::Diffuse { color: ColorInput::constant(Vec3::ONE) };
    let white = Material::new("white", white);
    let floor = Stage::from_above(1.0).bounces(0).square(Vec3::ZERO, Vec3::Y, 0.1, white.clone());
    let sun = Light::Sun { direction: Vec3::NEG_Y, irradiance: Vec3::ONE, angle: 0.0 };
    wall(wall(floor.light(sun), 2.0), 3.0).expect(64, 0.48 * 0.48 / PI);

    let floor = || Stage::from_above(1.0).bounces(0).sky(1.0).square(Vec3::ZERO, Vec3::Y, 0.1, white.clone());
    let (behind, error) = wall(floor(), 2.0).radiance(1 << 14);
    // 2 ∫ T(μ) μ dμ of the wall: half of what the clear dielectric of 1.5 passes of even light, 1 − 0.0918
    assert!((behind - 0.5 * 0.9082).abs() < 4.0 * error + 2e-3, "{behind} ± {error}");
}

#[test]
fn glass_that_disperses_is_white_in_a_white_sky() {
    let volume = Volume { attenuation_color: Vec3::ONE, attenuation_distance: f32::INFINITY };
    let glass = Layered { volume: Some(volume), dispersion: 2.0, ..clear(1.6) };
    let stage = Stage::new(Vec3::new(0.7, 0.0, 9.0), Vec3::new(0.7, 0.0, 0.0)).sky(1.0);
    let (mean, error) = stage.sphere(Vec3::ZERO, 1.0, layers(glass)).radiance(1 << 15);
    assert!((mean - 1.0).abs() < 4.0 * error, "{mean} ± {error}");
}

#[test]
fn a_coat_dims_the_emission_below_it() {
    let color = ColorInput::constant(Vec3::ONE);
    let one = ScalarInput::constant(1.0);
    let mut coated = clear(1.5);
    coated.transmission = None;
    coated.pbr.base_color = ColorInput::constant(Vec3::ZERO);
    coated.clearcoat = Some(Clearcoat { factor: one, roughness: ScalarInput::constant(0.0), normal: None });
    let emission = Some(Emission { color, strength: 10.0, two_sided: false });
    let panel = Material { emission, ..layers(coated) };
    let (mean, _) = Stage::from_above(3.0).square(Vec3::ZERO, Vec3::Y, 1.0, panel).radiance(16);
    assert!((mean - 9.6).abs() < 0.02, "{mean}");
}
