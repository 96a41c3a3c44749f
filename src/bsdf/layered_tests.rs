//! What must hold of layered materials: at every corner of their parameters samples follow their density, weights are eval
//! over pdf, and no energy is gained; where nothing absorbs, none is lost.

use glam::{Vec2, Vec3};

use super::fresnel::LayerCurve;
use super::*;
use crate::geometry::Frame;
use crate::sampling::stats::{chi2_test, r3};

const GOLD: Vec3 = Vec3::new(1.0, 0.78, 0.34);

fn towards(cos: f32, phi: f32) -> Vec3 {
    let sin = (1.0 - cos * cos).sqrt();
    Vec3::new(sin * phi.cos(), sin * phi.sin(), cos)
}

/// The parameters of a layered material, resolved at a point.
#[derive(Clone, Copy, Debug)]
struct Recipe {
    color: Vec3,
    metallic: f32,
    roughness: f32,
    anisotropy: f32,
    ior: f32,
    /// Factor and colour of KHR_materials_specular.
    specular: (f32, Vec3),
    coat: (f32, f32),
    sheen: (Vec3, f32),
    /// Share and whether it bounds a medium.
    transmission: (f32, bool),
    backlit: f32,
    film: (f32, f32),
    /// Of the base against the coat.
    tilt: f32,
}

const PLAIN: Recipe = Recipe {
    color: Vec3::ONE,
    metallic: 0.0,
    roughness: 0.5,
    anisotropy: 0.0,
    ior: 1.5,
    specular: (1.0, Vec3::ONE),
    coat: (0.0, 0.0),
    sheen: (Vec3::ZERO, 0.5),
    transmission: (0.0, false),
    backlit: 0.0,
    film: (0.0, 400.0),
    tilt: 0.0,
};

impl Recipe {
    fn layered(&self) -> Layered {
        let alpha = self.roughness * self.roughness;
        let alpha = Vec2::new(alpha + (1.0 - alpha) * self.anisotropy.powi(2), alpha);
        let facets = Facets::new(alpha, true);
        let exact = LayerCurve::dielectric(self.ior);
        let (level, tint) = self.specular;
        let f0 = (exact.f0 * tint).min(Vec3::ONE) * level;
        let curve = LayerCurve { f0, f90: Vec3::splat(level), rise: exact.rise };
        let film = |f0| ThinFilm::new(self.film.0, 1.3, self.film.1, f0);
        let dielectric = facets.prepare(Reflectance::dielectric(curve, film(f0)));
        let (share, thick) = self.transmission;
        let passage = match (share > 0.0, thick) {
            (false, _) => Passage::Opaque,
            (true, false) => Passage::Wall { share, tint: self.color },
            (true, true) => {
                let glass = Glass::new(alpha, true, dielectric, self.ior, self.color);
                Passage::Boundary { share, glass }
            }
        };
        let tilted = (self.tilt > 0.0).then(|| Frame::from_z(towards(self.tilt.cos(), 1.3)));
        Layered {
            base: Base {
                facets,
                metallic: self.metallic,
                metal: facets.prepare(Reflectance::metal(self.color, film(self.color))),
                dielectric,
                diffuse: (1.0 - self.backlit) * self.color,
                backlit: self.backlit * self.color,
                passage,
                matte: Vec3::Z,
            },
            sheen: Sheen::new(self.sheen.0, self.sheen.1 * self.sheen.1),
            coat: Coat::new(self.coat.0, self.coat.1 * self.coat.1),
            base_frame: tilted,
            coat_frame: (self.tilt > 0.0).then(|| Frame::from_z(towards((0.5 * self.tilt).cos(), 4.0))),
            seen: None,
        }
    }

    fn bsdf(&self) -> Bsdf {
        Bsdf::Layered(Box::new(self.layered()))
    }
}

/// Each layer by itself, and combinations.
fn recipes() -> Vec<(&'static str, Recipe)> {
    let smooth = Recipe { roughness: 0.2, ..PLAIN };
    vec![
        ("plain", PLAIN),
        ("metal", Recipe { metallic: 1.0, color: GOLD, ..PLAIN }),
        ("anisotropic", Recipe { metallic: 0.5, anisotropy: 0.7, roughness: 0.4, ..PLAIN }),
        ("coat", Recipe { coat: (1.0, 0.3), ..PLAIN }),
        ("coat over a tilted base", Recipe { coat: (0.7, 0.4), tilt: 0.5, roughness: 0.4, ..PLAIN }),
        ("sheen", Recipe { sheen: (Vec3::ONE, 0.3), ..PLAIN }),
        ("soft sheen", Recipe { sheen: (GOLD, 1.0), color: GOLD, ..PLAIN }),
        ("specular", Recipe { specular: (0.5, Vec3::new(1.0, 0.2, 5.0)), ..smooth }),
        ("wall", Recipe { transmission: (1.0, false), ..PLAIN }),
        ("part wall", Recipe { transmission: (0.5, false), backlit: 0.4, color: GOLD, ..PLAIN }),
        ("glass", Recipe { transmission: (1.0, true), ..PLAIN }),
        ("glass from inside", Recipe { transmission: (1.0, true), ior: 1.0 / 1.5, ..PLAIN }),
        ("part glass", Recipe { transmission: (0.6, true), roughness: 0.6, ..PLAIN }),
        ("anisotropic glass", Recipe { transmission: (1.0, true), anisotropy: 0.6, ..PLAIN }),
        ("backlit", Recipe { backlit: 0.7, ..PLAIN }),
        ("iridescent", Recipe { film: (1.0, 400.0), color: Vec3::ZERO, ..PLAIN }),
        ("iridescent metal", Recipe { film: (1.0, 600.0), metallic: 1.0, color: GOLD, ..PLAIN }),
        (
            "all of it",
            Recipe {
                metallic: 0.2,
                anisotropy: 0.5,
                coat: (0.5, 0.4),
                sheen: (0.5 * GOLD, 0.4),
                transmission: (0.5, true),
                backlit: 0.3,
                film: (0.6, 300.0),
                ..PLAIN
            },
        ),
    ]
}

/// The energy that leaves, per channel, when light arrives from everywhere alike.
fn furnace(lobe: &Bsdf, wo: Vec3) -> Vec3 {
    const POINTS: u32 = 610;
    const STRATA: u32 = 8;
    let mut sum = [0f64; 3];
    for i in 0..POINTS {
        let u = Vec2::new((i as f32 + 0.5) / POINTS as f32, (i * 377 % POINTS) as f32 / POINTS as f32);
        for k in 0..STRATA {
            let u_lobe = (k as f32 + (i as f32 * 0.754_877_7).fract()) / STRATA as f32;
            if let Some(s) = lobe.sample(wo, u, u_lobe) {
                let energy = s.weight * (s.eta * s.eta);
                (0..3).for_each(|c| sum[c] += f64::from(energy[c]));
            }
        }
    }
    Vec3::from(sum.map(|s| (s / f64::from(POINTS * STRATA)) as f32))
}

const VIEWS: [f32; 4] = [1.0, 0.6, 0.2, 0.05];

#[test]
fn samples_follow_their_density() {
    for (name, recipe) in recipes() {
        let lobe = recipe.bsdf();
        // albedos by quadrature are slow at this number of points, and a film moves the shares of lobes only
        if recipe.film.0 > 0.0 && recipe.anisotropy == 0.0 {
            continue;
        }
        let views = [towards(0.5, 0.3), towards(0.9, 4.0)];
        let slow = recipe.anisotropy > 0.0;
        let views = if slow { &views[..1] } else { &views };
        for &wo in views {
            chi2_test(
                &format!("{name} from {wo}"),
                |[a, b, c]| lobe.sample(wo, Vec2::new(a, b), c).map(|s| s.wi),
                |wi| lobe.eval_pdf(wo, wi).1,
            );
        }
    }
}

/// At grazing angles, at the ends of the uniform numbers, at roughness 0: finite, and never negative.
#[test]
fn corners_are_finite() {
    const COSINES: [f32; 5] = [1e-8, 1e-4, 0.3, 0.999_999_9, 1.0];
    const NUMBERS: [f32; 4] = [0.0, 1e-8, 0.5, 1.0 - f32::EPSILON / 2.0];
    for (name, recipe) in recipes() {
        for roughness in [0.0, 0.02, 1.0] {
            let lobe = Recipe { roughness, ..recipe }.bsdf();
            for cos in COSINES {
                let wo = towards(cos, 0.0);
                for (i, cos_i) in COSINES.iter().flat_map(|c| [*c, -c]).enumerate() {
                    let wi = towards(cos_i, i as f32);
                    let (f, pdf) = lobe.eval_pdf(wo, wi);
                    assert!(f.is_finite() && f.min_element() >= 0.0, "{name} {roughness}: {wo} {wi}: {f}");
                    assert!(pdf.is_finite() && pdf >= 0.0, "{name} {roughness}: {wo} {wi}: {pdf}");
                }
                for i in 0..64 {
                    let [a, b, c] = [i & 3, i >> 2 & 3, i >> 4].map(|k| NUMBERS[k]);
                    if let Some(s) = lobe.sample(wo, Vec2::new(a, b), c) {
                        let sound = s.weight.is_finite() && s.weight.min_element() >= 0.0 && s.pdf > 0.0;
                        assert!(sound && s.pdf.is_finite(), "{name} {roughness} from {wo}: {s:?}");
                        assert!((s.wi.length() - 1.0).abs() < 1e-4, "{name} {roughness} from {wo}: {s:?}");
                    }
                }
            }
        }
    }
}

#[test]
fn weights_are_eval_over_pdf() {
    for (name, recipe) in recipes() {
        let lobe = recipe.bsdf();
        for wo in [towards(0.9, 0.3), towards(0.25, 4.0)] {
            for i in 0..300 {
                let [a, b, c] = r3(i);
                let Some(s) = lobe.sample(wo, Vec2::new(a, b), c) else { continue };
                let (f, pdf) = lobe.eval_pdf(wo, s.wi);
                assert!((pdf - s.pdf).abs() <= 1e-4 * pdf, "{name}: {pdf}, sampled {}", s.pdf);
                assert!((f / pdf).abs_diff_eq(s.weight, 1e-3 * s.weight.max_element()), "{name}: {f}, {s:?}");
                assert_eq!(s.wi.z > 0.0, s.kind != Kind::Transmission, "{name}: {s:?}");
                assert!((s.wi.length() - 1.0).abs() < 1e-5);
            }
        }
    }
}

/// Layers that absorb nothing, at any roughness, are white in a white furnace.
#[test]
fn white_layers_keep_all_energy() {
    let white = [
        ("plain", PLAIN, 0.006),
        ("half metal", Recipe { metallic: 0.5, ..PLAIN }, 0.006),
        ("coat", Recipe { coat: (1.0, 0.0), ..PLAIN }, 0.008),
        ("rough coat", Recipe { coat: (0.5, 1.0), metallic: 0.3, ..PLAIN }, 0.008),
        ("sheen", Recipe { sheen: (Vec3::ONE, 0.5), ..PLAIN }, 0.01),
        ("fine sheen", Recipe { sheen: (Vec3::ONE, 0.1), ..PLAIN }, 0.03),
        ("specular", Recipe { specular: (0.3, Vec3::ONE), ..PLAIN }, 0.008),
        ("wall", Recipe { transmission: (1.0, false), ..PLAIN }, 0.008),
        ("backlit wall", Recipe { transmission: (0.5, false), backlit: 0.5, ..PLAIN }, 0.008),
        ("glass", Recipe { transmission: (1.0, true), ..PLAIN }, 0.008),
        ("glass from inside", Recipe { transmission: (1.0, true), ior: 1.0 / 1.5, ..PLAIN }, 0.008),
        ("dense glass", Recipe { transmission: (1.0, true), ior: 2.4, ..PLAIN }, 0.008),
        ("water, in part", Recipe { transmission: (0.5, true), ior: 1.33, ..PLAIN }, 0.008),
        ("no boundary", Recipe { transmission: (1.0, true), ior: 1.0, ..PLAIN }, 0.008),
        ("brushed metal", Recipe { metallic: 1.0, anisotropy: 0.6, ..PLAIN }, 0.02),
        ("brushed to the utmost", Recipe { metallic: 1.0, anisotropy: 1.0, ..PLAIN }, 0.03),
        ("iridescent", Recipe { film: (1.0, 400.0), ..PLAIN }, 0.25),
        ("iridescent glass", Recipe { film: (1.0, 400.0), transmission: (1.0, true), ..PLAIN }, 0.03),
    ];
    for (name, recipe, tolerance) in white {
        let (mut low, mut high) = (f32::MAX, f32::MIN);
        for step in 0..=5 {
            let lobe = Recipe { roughness: step as f32 / 5.0, ..recipe }.bsdf();
            for cos in VIEWS {
                let energy = furnace(&lobe, towards(cos, 1.0));
                (low, high) = (low.min(energy.min_element()), high.max(energy.max_element()));
            }
        }
        println!("white furnace, {name}: {low:.4} to {high:.4}");
        assert!(
            low > 1.0 - tolerance && high < 1.01_f32.max(1.0 + tolerance.min(0.03)),
            "{name}: {low} to {high}"
        );
    }
}

/// Every corner of the parameters at once: none gives more than it gets.
#[test]
fn no_corner_gains_energy() {
    let (mut worst, mut cases) = (0f32, 0);
    for bits in 0..1u32 << 10 {
        // one in eleven, evenly
        if bits % 11 != 0 {
            continue;
        }
        let bit = |i: u32| bits >> i & 1 == 1;
        let full = |i: u32| if bit(i) { 1.0 } else { 0.0 };
        let recipe = Recipe {
            color: if bit(0) { Vec3::ONE } else { GOLD },
            metallic: full(1),
            roughness: if bit(2) { 1.0 } else { 0.0 },
            anisotropy: full(3),
            ior: if bit(4) { 1.5 } else { 1.0 / 2.4 },
            specular: if bit(5) { (1.0, Vec3::new(3.0, 1.0, 0.0)) } else { (1.0, Vec3::ONE) },
            coat: (full(6), full(2)),
            sheen: (Vec3::splat(full(7)), 1.0 - full(2)),
            transmission: (full(8), bit(3)),
            backlit: 1.0 - full(8),
            film: (full(9), 350.0),
            tilt: 0.0,
        };
        let lobe = recipe.bsdf();
        for cos in [0.9, 0.1] {
            let energy = furnace(&lobe, towards(cos, 0.7)).max_element();
            worst = worst.max(energy);
            assert!(energy < 1.04 && energy.is_finite(), "{recipe:?} at {cos}: {energy}");
            cases += 1;
        }
    }
    println!("{cases} corners, at most {worst:.4}");
}

/// A recipe without layers is the plain material, lobe for lobe.
#[test]
fn without_layers_it_is_the_plain_material() {
    for (metallic, roughness) in [(0.0, 0.3), (0.4, 0.8), (1.0, 0.5)] {
        let recipe = Recipe { metallic, roughness, color: GOLD, ..PLAIN };
        let layered = recipe.bsdf();
        let plain =
            Pbr::bsdf(GOLD, metallic, roughness * roughness, LayerCurve::dielectric(1.5), true, Vec3::Z);
        for i in 0..200 {
            let [a, b, c] = r3(i);
            let (wo, wi) = (towards(1.0 - a, 0.0), towards(1.0 - b, std::f32::consts::TAU * c));
            let ((f, p), (g, q)) = (layered.eval_pdf(wo, wi), plain.eval_pdf(wo, wi));
            assert!(f.abs_diff_eq(g, 1e-3 * g.max_element() + 1e-6), "{f} {g}");
            assert!((p - q).abs() < 1e-3 * q + 1e-6, "{p} {q}");
        }
    }
}

/// Iridescence of thickness 0, sheen of no colour, coat of factor 0: the bits are the same.
#[test]
fn layers_without_weight_change_nothing() {
    let none = Recipe {
        coat: (0.0, 0.7),
        sheen: (Vec3::ZERO, 0.9),
        film: (1.0, 0.0),
        transmission: (0.0, true),
        ..PLAIN
    };
    let (without, with) = (PLAIN.bsdf(), none.bsdf());
    for i in 0..500 {
        let [a, b, c] = r3(i);
        let (wo, wi) = (towards(1.0 - a, 0.0), towards(1.0 - b, std::f32::consts::TAU * c));
        assert_eq!(without.eval_pdf(wo, wi), with.eval_pdf(wo, wi));
    }
}

/// Glass and thin walls without compensation, the coat alone and sheen alone are the same both ways.
#[test]
fn lobes_are_reciprocal() {
    let sheen = Sheen::new(GOLD, 0.3).expect("sheen");
    let coat = Coat::new(1.0, 0.2).expect("coat");
    let facets = Facets::new(Vec2::new(0.5, 0.1), false);
    let curve = facets.prepare(Reflectance::dielectric(LayerCurve::dielectric(1.5), None));
    let (into, out) = (
        Glass::new(Vec2::new(0.5, 0.1), false, curve, 1.5, GOLD),
        Glass::new(Vec2::new(0.5, 0.1), false, curve, 1.0 / 1.5, GOLD),
    );
    let close =
        |a: f32, b: f32, what: &str| assert!((a - b).abs() <= 3e-3 * a.max(b) + 1e-4, "{what}: {a} {b}");
    for i in 0..500 {
        let [a, b, c] = r3(i);
        let (wo, wi) = (towards(0.05 + 0.95 * a, 0.4), towards(0.05 + 0.95 * b, std::f32::consts::TAU * c));
        close(sheen.eval(wo, wi).y / wi.z, sheen.eval(wi, wo).y / wo.z, "sheen");
        close(coat.eval_pdf(wo, wi).0 / wi.z, coat.eval_pdf(wi, wo).0 / wo.z, "coat");
        close(into.eval_pdf(wo, wi).0.y / wi.z, into.eval_pdf(wi, wo).0.y / wo.z, "reflection");
        // light that goes down here comes up there, where the frame is turned over
        let turned = |w: Vec3| Vec3::new(w.x, w.y, -w.z);
        let down = turned(wi);
        close(
            2.25 * into.eval_pdf(wo, down).0.y / wi.z,
            out.eval_pdf(wi, turned(wo)).0.y / wo.z,
            "refraction",
        );
    }
}

/// Sheen and what it leaves to a white base are one: the albedo by its table, drawn.
#[test]
fn sheen_has_the_albedo_of_its_table() {
    for roughness in [0.1f32, 0.3, 0.6, 1.0] {
        let recipe =
            Recipe { color: Vec3::ZERO, specular: (0.0, Vec3::ONE), sheen: (Vec3::ONE, roughness), ..PLAIN };
        let lobe = recipe.bsdf();
        for cos in [1.0, 0.5, 0.2] {
            let expected = Sheen::new(Vec3::ONE, roughness * roughness).expect("sheen").white_albedo(cos);
            let energy = furnace(&lobe, towards(cos, 0.0)).x;
            assert!((energy - expected).abs() < 0.01, "{roughness} {cos}: {energy}, table {expected}");
        }
    }
}

/// A smooth thin wall of clear glass: what the layer does not reflect passes straight, tinted once.
#[test]
fn smooth_walls_pass_light_straight() {
    let lobe = Recipe { roughness: 0.0, transmission: (1.0, false), color: GOLD, ..PLAIN }.bsdf();
    let wo = towards(0.7, 1.0);
    let s = lobe.sample(wo, Vec2::splat(0.5), 0.99).expect("passes");
    assert!(s.delta && s.wi == -wo && s.eta == 1.0);
    let reflected = fresnel::DielectricFresnel::Exact.reflectance(0.7, 1.5).0;
    let passed = s.weight * s.pdf;
    assert!(passed.abs_diff_eq((1.0 - reflected) * GOLD, 2e-3), "{passed}");
}

/// Smooth glass follows Snell and tints what it refracts, not what it reflects.
#[test]
fn smooth_glass_is_a_pair_of_deltas() {
    let lobe = Recipe { roughness: 0.0, transmission: (1.0, true), color: GOLD, ..PLAIN }.bsdf();
    let wo = towards(0.6, 0.3);
    let reflectance = fresnel::DielectricFresnel::Exact.reflectance(0.6, 1.5).0;
    let r = lobe.sample(wo, Vec2::splat(0.5), 0.0).expect("reflects");
    assert!(
        r.delta && r.kind == Kind::Glossy && (r.weight * r.pdf).abs_diff_eq(Vec3::splat(reflectance), 1e-4)
    );
    let t = lobe.sample(wo, Vec2::splat(0.5), 0.999).expect("refracts");
    assert!(t.delta && t.eta == 1.5 && (t.wi.truncate().length() - 0.8 / 1.5).abs() < 1e-5);
    let passed = t.weight * t.pdf * 2.25;
    assert!(passed.abs_diff_eq((1.0 - reflectance) * GOLD, 1e-4), "{passed}");
}
