//! A camera that has everything in the picture: three-quarter view from slightly above.

use glam::{Affine3A, DVec3, Mat3A};

use crate::world::{Camera, Projection, World};

/// What a framed camera has when nothing is said.
pub(super) const USUAL: Projection = Projection::Perspective { vfov: 35.0 * std::f32::consts::PI / 180.0 };

/// From where the camera looks: to the right of the front (+Z) and above the horizon, radians.
const AZIMUTH: f64 = 30.0 * std::f64::consts::PI / 180.0;
const ELEVATION: f64 = 15.0 * std::f64::consts::PI / 180.0;

/// The frame is this much larger than what it holds.
const MARGIN: f64 = 1.1;

/// A sphere so many times larger than the median is ground to stand on, and not to be framed.
const GROUND: f64 = 50.0;

/// What is farther out than this, in metres, is no subject; squares of it are finite in `f32`.
const FARTHEST: f64 = 1e18;

/// An axis-aligned box, in double precision so that nothing overflows.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Bounds {
    pub min: DVec3,
    pub max: DVec3,
}

impl Bounds {
    const EMPTY: Self = Self { min: DVec3::INFINITY, max: DVec3::NEG_INFINITY };
    pub const UNIT: Self = Self { min: DVec3::NEG_ONE, max: DVec3::ONE };

    /// Of what a picture of `world` should show; a unit box where there is nothing.
    pub fn of_subject(world: &World) -> Self {
        let shapes = shapes(world);
        let mut sizes: Vec<f64> = shapes.iter().map(|shape| shape.bounds.half_diagonal()).collect();
        sizes.sort_by(f64::total_cmp);
        let median = sizes.get(sizes.len().saturating_sub(1) / 2).copied().unwrap_or(0.0);
        let subject = |shape: &&Shape| !shape.is_sphere || shape.bounds.half_diagonal() < GROUND * median;
        let all = |bounds: Self, shape: &Shape| bounds.union(&shape.bounds);
        let bounds = shapes.iter().filter(subject).fold(Self::EMPTY, all);
        if bounds.is_finite() { bounds } else { Self::UNIT }
    }

    pub fn center(&self) -> DVec3 {
        (self.min + self.max) / 2.0
    }

    pub fn half_diagonal(&self) -> f64 {
        (self.max - self.min).length() / 2.0
    }

    /// Half the diagonal, or 1 where there is no extent to speak of at this distance from the origin.
    pub fn radius(&self) -> f64 {
        let extent = self.half_diagonal();
        let resolved = 1e-6 * self.center().length();
        if extent > resolved.max(1e-12) { extent } else { resolved.max(1.0) }
    }

    pub fn contains(&self, point: DVec3) -> bool {
        point.cmpge(self.min).all() && point.cmple(self.max).all()
    }

    fn is_finite(&self) -> bool {
        self.min.is_finite() && self.max.is_finite()
    }

    fn union(&self, other: &Self) -> Self {
        Self { min: self.min.min(other.min), max: self.max.max(other.max) }
    }

    fn with(&self, point: DVec3) -> Self {
        if point.abs().max_element() < FARTHEST {
            self.union(&Self { min: point, max: point })
        } else {
            *self
        }
    }

    pub fn corners(&self) -> [DVec3; 8] {
        std::array::from_fn(|i| {
            let pick = |bit: usize, low: f64, high: f64| if i >> bit & 1 == 0 { low } else { high };
            DVec3::new(
                pick(0, self.min.x, self.max.x),
                pick(1, self.min.y, self.max.y),
                pick(2, self.min.z, self.max.z),
            )
        })
    }
}

struct Shape {
    bounds: Bounds,
    is_sphere: bool,
}

fn shapes(world: &World) -> Vec<Shape> {
    let spheres = world.spheres.iter().map(|sphere| {
        let (center, radius) = (sphere.center.as_dvec3(), f64::from(sphere.radius));
        Shape { bounds: Bounds { min: center - radius, max: center + radius }, is_sphere: true }
    });
    let quads = world.quads.iter().map(|quad| {
        let [origin, u, v] = [quad.origin, quad.u, quad.v].map(|p| p.as_dvec3());
        let corners = [origin, origin + u, origin + v, origin + u + v];
        Shape { bounds: corners.iter().fold(Bounds::EMPTY, |bounds, p| bounds.with(*p)), is_sphere: false }
    });
    let instances = world.model.instances.iter().filter_map(|instance| {
        let mesh = world.model.meshes.get(instance.mesh.index())?;
        // Only vertices that are used: others may be anywhere.
        let used = mesh.triangles.iter().flatten().filter_map(|&i| mesh.positions.get(i as usize));
        let placed = used.map(|p| instance.to_world.transform_point3(*p).as_dvec3());
        let bounds = placed.fold(Bounds::EMPTY, |bounds, p| bounds.with(p));
        bounds.is_finite().then_some(Shape { bounds, is_sphere: false })
    });
    spheres.chain(quads).chain(instances).collect()
}

/// A camera from which all corners of `bounds` are inside a picture of this aspect (width over height).
pub(super) fn frame(bounds: &Bounds, projection: Projection, aspect: f32) -> Camera {
    let back = DVec3::new(AZIMUTH.sin() * ELEVATION.cos(), ELEVATION.sin(), AZIMUTH.cos() * ELEVATION.cos());
    let right = DVec3::Y.cross(back).normalize();
    let up = back.cross(right);
    let (center, radius) = (bounds.center(), bounds.radius());
    let distance = match projection {
        Projection::Perspective { vfov } => {
            let high = (f64::from(vfov) / 2.0).tan() / MARGIN;
            let wide = high * f64::from(aspect);
            // A corner at depth `distance − z` is inside while |x| ≤ depth · wide and |y| ≤ depth · high.
            let reach = |corner: DVec3| {
                let p = corner - center;
                p.dot(back) + (p.dot(right).abs() / wide).max(p.dot(up).abs() / high)
            };
            bounds.corners().map(reach).into_iter().fold(0.0, f64::max)
        }
        Projection::Orthographic { .. } => 3.0 * radius,
    };
    // A point, or a line along the view, is not to be touched.
    let nearest = bounds.corners().map(|corner| (corner - center).dot(back)).into_iter().fold(0.0, f64::max);
    let distance = distance.max(nearest + 0.2 * radius);
    let matrix3 = Mat3A::from_cols(right.as_vec3a(), up.as_vec3a(), back.as_vec3a());
    let translation = (center + distance * back).as_vec3a();
    Camera {
        name: "framed".into(),
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
                    let camera = frame(&bounds, projection, aspect);
                    assert!(camera.to_world.is_finite() && camera.focus > 0.0);
                    let places = bounds
                        .corners()
                        .map(|corner| in_picture(&camera, aspect, corner).abs().max_element());
                    let farthest = places.into_iter().fold(0.0, f64::max);
                    assert!(farthest < 0.95, "{bounds:?} {aspect} {vfov}: {farthest}");
                    if bounds.half_diagonal() > 0.0 && vfov < 100.0 && aspect > 0.5 {
                        assert!(farthest > 0.8, "{bounds:?} {aspect} {vfov}: wastes the picture, {farthest}");
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
            camera: frame(&Bounds::UNIT, USUAL, 1.0),
        };
        let subject = Bounds { min: DVec3::new(-1.0, 0.0, -1.0), max: DVec3::new(1.0, 2.0, 1.0) };
        assert_eq!(Bounds::of_subject(&world), subject);
        world.spheres.truncate(1);
        assert_eq!(Bounds::of_subject(&world).radius(), 1000.0 * 3f64.sqrt(), "alone it is the subject");
        world.spheres.clear();
        assert_eq!(Bounds::of_subject(&world), Bounds::UNIT);
    }
}
