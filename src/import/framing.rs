//! A camera that has everything in the picture: three-quarter view from slightly above.

use glam::{Affine3A, DVec3, Mat3A};

use super::bounds::Bounds;
use crate::world::{Camera, Instance, Mesh, Projection, Quad, Sphere, World};

/// What a framed camera has when nothing is said.
pub(super) const USUAL: Projection = Projection::Perspective { vfov: 35.0 * std::f32::consts::PI / 180.0 };

/// From where the camera looks: to the right of the front (+Z) and above the horizon, radians.
const AZIMUTH: f64 = 30.0 * std::f64::consts::PI / 180.0;
const ELEVATION: f64 = 15.0 * std::f64::consts::PI / 180.0;

/// The frame is this much larger than what it holds.
const MARGIN: f64 = 1.15;

/// A sphere so many times larger than the median is ground to stand on, and not to be framed.
const GROUND: f64 = 50.0;

/// What is farther out than this, in metres, is no subject; squares of it are finite in `f32`.
const FARTHEST: f64 = 1e18;

/// What a picture of a world should show: everything, except the ground.
pub(super) struct Subject<'w> {
    forms: Vec<Form<'w>>,
    pub bounds: Bounds,
}

/// Something with an extent.
enum Form<'w> {
    Sphere(&'w Sphere),
    Quad(&'w Quad),
    Mesh(&'w Instance, &'w Mesh),
    Box(Bounds),
}

impl<'w> Subject<'w> {
    /// A unit box where there is nothing.
    pub fn of(world: &'w World) -> Self {
        let meshes = world.model.instances.iter().filter_map(|instance| {
            Some(Form::Mesh(instance, world.model.meshes.get(instance.mesh.index())?))
        });
        let spheres = world.spheres.iter().map(Form::Sphere);
        let forms = spheres.chain(world.quads.iter().map(Form::Quad)).chain(meshes);
        let mut forms: Vec<(Form, Bounds)> = forms
            .map(|form| (form.bounds(), form))
            .filter(|(b, _)| b.is_finite())
            .map(|(b, f)| (f, b))
            .collect();
        let mut sizes: Vec<f64> = forms.iter().map(|(_, bounds)| bounds.half_diagonal()).collect();
        sizes.sort_by(f64::total_cmp);
        let median = sizes.get(sizes.len().saturating_sub(1) / 2).copied().unwrap_or(0.0);
        forms.retain(|(form, bounds)| {
            !matches!(form, Form::Sphere(_)) || bounds.half_diagonal() < GROUND * median || median == 0.0
        });
        if forms.is_empty() {
            return Self::boxed(Bounds::UNIT);
        }
        let bounds = forms.iter().fold(Bounds::EMPTY, |all, (_, bounds)| all.union(bounds));
        Self { forms: forms.into_iter().map(|(form, _)| form).collect(), bounds }
    }

    pub fn boxed(bounds: Bounds) -> Subject<'static> {
        Subject { forms: vec![Form::Box(bounds)], bounds }
    }

    /// How far the subject reaches along each of `directions`, from the middle of its bounds.
    fn reach<const N: usize>(&self, directions: [DVec3; N]) -> [f64; N] {
        let (center, mut reach) = (self.bounds.center(), [f64::NEG_INFINITY; N]);
        for form in &self.forms {
            form.for_each_point(|p, radius| {
                for (reach, direction) in reach.iter_mut().zip(directions) {
                    *reach = reach.max((p - center).dot(direction) + radius * direction.length());
                }
            });
        }
        reach
    }
}

impl Form<'_> {
    /// Points with a ball about each: all that is inside their convex hull may be part of the form.
    fn for_each_point(&self, mut f: impl FnMut(DVec3, f64)) {
        let mut near = |p: DVec3, radius: f64| {
            if p.abs().max_element() + radius < FARTHEST {
                f(p, radius);
            }
        };
        match self {
            Form::Sphere(sphere) => near(sphere.center.as_dvec3(), sphere.radius.into()),
            Form::Quad(quad) => {
                let [origin, u, v] = [quad.origin, quad.u, quad.v].map(|p| p.as_dvec3());
                [origin, origin + u, origin + v, origin + u + v].into_iter().for_each(|p| near(p, 0.0));
            }
            Form::Mesh(instance, mesh) => {
                // Only vertices that are used: others may be anywhere.
                for p in mesh.triangles.iter().flatten().filter_map(|&i| mesh.positions.get(i as usize)) {
                    near(instance.to_world.transform_point3(*p).as_dvec3(), 0.0);
                }
            }
            Form::Box(bounds) => bounds.corners().into_iter().for_each(|p| near(p, 0.0)),
        }
    }

    fn bounds(&self) -> Bounds {
        let mut bounds = Bounds::EMPTY;
        self.for_each_point(|p, radius| bounds = bounds.union(&Bounds { min: p - radius, max: p + radius }));
        bounds
    }
}

/// A camera that has all of `subject` in a picture of this aspect (width over height), and in its middle.
///
/// With x, y, z along the camera's right, up and back and half the picture w · h at distance 1, what is at x is inside
/// of the right edge of a camera at (c, ·, d) while x − c ≤ (d − z) w, which is x/w + z ≤ d + c/w. So d + c/w is the
/// subject's reach along (1/w, 0, 1), and d − c/w that along (−1/w, 0, 1).
pub(super) fn frame(subject: &Subject, projection: Projection, aspect: f32) -> Camera {
    let back = DVec3::new(AZIMUTH.sin() * ELEVATION.cos(), ELEVATION.sin(), AZIMUTH.cos() * ELEVATION.cos());
    let right = DVec3::Y.cross(back).normalize();
    let up = back.cross(right);
    let radius = subject.bounds.radius();
    let (x, y, distance) = match projection {
        Projection::Perspective { vfov } => {
            let h = (f64::from(vfov) / 2.0).tan() / MARGIN;
            let w = h * f64::from(aspect);
            let [r, l, t, b, nearest] =
                subject.reach([right / w + back, back - right / w, up / h + back, back - up / h, back]);
            // What has no extent is not to be touched.
            let distance = ((r + l) / 2.0).max((t + b) / 2.0).max(nearest + 0.05 * radius);
            (w * (r - l) / 2.0, h * (t - b) / 2.0, distance)
        }
        Projection::Orthographic { .. } => {
            let [r, l, t, b] = subject.reach([right, -right, up, -up]);
            ((r - l) / 2.0, (t - b) / 2.0, 3.0 * radius)
        }
    };
    let matrix3 = Mat3A::from_cols(right.as_vec3a(), up.as_vec3a(), back.as_vec3a());
    let translation = (subject.bounds.center() + x * right + y * up + distance * back).as_vec3a();
    Camera {
        name: "framed".into(),
        node: String::new(),
        to_world: Affine3A { matrix3, translation },
        projection,
        aperture: 0.0,
        focus: distance as f32,
    }
}

/// How far the middle of `bounds` is in front of `camera`; at least a hundredth of their size.
pub(super) fn distance_along_view(camera: &Camera, bounds: &Bounds) -> f32 {
    let back = camera.to_world.matrix3.z_axis.as_dvec3();
    let depth = (camera.to_world.translation.as_dvec3() - bounds.center()).dot(back);
    depth.max(0.01 * bounds.radius()) as f32
}

#[cfg(test)]
mod tests {
    use glam::{DVec2, Vec3};

    use super::*;
    use crate::world::{Environment, EnvironmentKind, MaterialId, Model, Sphere};

    /// Where a point is in the picture: ±1 at its edges.
    fn in_picture(camera: &Camera, aspect: f32, point: DVec3) -> DVec2 {
        let p =
            camera.to_world.matrix3.transpose().as_dmat3() * (point - camera.to_world.translation.as_dvec3());
        let Projection::Perspective { vfov } = camera.projection else { panic!("is perspective") };
        let high = f64::from((vfov / 2.0).tan()) * -p.z;
        assert!(p.z < 0.0, "is in front");
        DVec2::new(p.x / (high * f64::from(aspect)), p.y / high)
    }

    #[test]
    fn everything_is_in_the_picture() {
        let boxes = [
            (DVec3::NEG_ONE, DVec3::ONE),
            (DVec3::new(-100.0, 0.0, -1.0), DVec3::new(100.0, 1.0, 1.0)),
            (DVec3::new(0.0, 0.0, 0.0), DVec3::new(0.0, 5.0, 0.0)),
            (DVec3::splat(7.0), DVec3::splat(7.0)),
            (DVec3::splat(-1e12), DVec3::splat(1e12)),
            (DVec3::splat(-1e-5), DVec3::splat(1e-5)),
        ];
        for (min, max) in boxes {
            let bounds = Bounds { min, max };
            for aspect in [0.1, 1.0, 16.0 / 9.0, 10.0] {
                for vfov in [5f32, 35.0, 120.0] {
                    let projection = Projection::Perspective { vfov: vfov.to_radians() };
                    let camera = frame(&Subject::boxed(bounds), projection, aspect);
                    assert!(camera.to_world.is_finite() && camera.focus > 0.0);
                    let places = bounds.corners().map(|corner| in_picture(&camera, aspect, corner));
                    let low = places.into_iter().fold(DVec2::INFINITY, DVec2::min);
                    let high = places.into_iter().fold(DVec2::NEG_INFINITY, DVec2::max);
                    let case = format!("{bounds:?} {aspect} {vfov}: {low} {high}");
                    assert!(low.min_element() > -0.95 && high.max_element() < 0.95, "{case}");
                    if bounds.half_diagonal() > 0.0 && vfov < 100.0 {
                        // Exactly so along the side that decides, nearly along the other; unless it is so wide a
                        // picture of so long a thing that the camera would touch its end.
                        let middle = (low + high).abs().min_element() < 2e-3;
                        assert!(middle || aspect > 2.0, "{case}: not in the middle");
                        assert!(high.max_element() > 0.8, "{case}: wastes the picture");
                    }
                }
            }
        }
    }

    #[test]
    fn the_ground_is_no_subject() {
        let sphere =
            |y: f32, radius: f32| Sphere { center: Vec3::new(0.0, y, 0.0), radius, material: MaterialId(0) };
        let mut world = World {
            model: Model::default(),
            spheres: vec![sphere(-1000.0, 1000.0), sphere(1.0, 1.0)],
            quads: Vec::new(),
            environment: Environment {
                kind: EnvironmentKind::Color(Vec3::ONE),
                strength: 1.0,
                rotation: 0.0,
                visible: true,
            },
            camera: frame(&Subject::boxed(Bounds::UNIT), USUAL, 1.0),
        };
        let subject = Bounds { min: DVec3::new(-1.0, 0.0, -1.0), max: DVec3::new(1.0, 2.0, 1.0) };
        assert_eq!(Subject::of(&world).bounds, subject);
        world.spheres.truncate(1);
        assert_eq!(Subject::of(&world).bounds.radius(), 1000.0 * 3f64.sqrt(), "alone it is the subject");
        world.spheres.clear();
        assert_eq!(Subject::of(&world).bounds, Bounds::UNIT);
    }
}
