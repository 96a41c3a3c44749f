//! From a point on the picture to a ray: perspective or orthographic projection, thin lens.
//!
//! The camera looks along −Z of its frame with +Y up. A picture point (x, y), in pixels from the top left of the
//! whole picture, is a point of the viewport at distance 1; all rays through it meet again in the plane of focus,
//! wherever on the lens they start (*Ray Tracing in One Weekend*, "Defocus Blur"). Every lens point is equally
//! likely, so a pixel's value is a plain mean of radiances (no cos⁴ vignetting: Cycles, Mitsuba and POV-Ray agree).

mod filter;

use glam::{Affine3A, Mat3A, Vec2, Vec3};

pub use filter::FilterTable;

use crate::{geometry::Ray, sampling::warp::concentric_disk, world};

#[derive(Clone, Debug)]
pub struct Camera {
    to_world: Affine3A,
    /// The inverse, where lengths are the same in both.
    to_camera: Option<Affine3A>,
    /// Viewport units per pixel, and the viewport point of the picture's top left corner.
    pixel: f32,
    corner: Vec2,
    orthographic: bool,
    lens_radius: f32,
    focus: f32,
}

impl Camera {
    /// For a picture of `size` pixels.
    pub fn new(camera: &world::Camera, size: [u32; 2]) -> Self {
        let [width, height] = size.map(|n| n.max(1) as f32);
        let (half_height, orthographic) = match camera.projection {
            world::Projection::Perspective { vfov } => ((0.5 * vfov).tan(), false),
            world::Projection::Orthographic { half_height } => (half_height, true),
        };
        let pixel = 2.0 * half_height / height;
        Self {
            to_world: camera.to_world,
            to_camera: (is_rigid(&camera.to_world) && !orthographic).then(|| camera.to_world.inverse()),
            pixel,
            corner: Vec2::new(-0.5 * width * pixel, half_height),
            orthographic,
            lens_radius: 0.5 * camera.aperture,
            focus: camera.focus,
        }
    }

    /// The ray (unit direction) through picture point `at` and lens point `lens` (uniform in the unit square).
    pub fn ray(&self, at: Vec2, lens: Vec2) -> Ray {
        let viewport = self.corner + Vec2::new(at.x, -at.y) * self.pixel;
        let (origin, direction) = if self.orthographic {
            (viewport.extend(0.0), Vec3::NEG_Z)
        } else {
            (Vec3::ZERO, viewport.extend(-1.0))
        };
        let (origin, direction) = if self.lens_radius > 0.0 {
            let focused = origin + self.focus * direction;
            let origin = origin + (self.lens_radius * concentric_disk(lens)).extend(0.0);
            (origin, focused - origin)
        } else {
            (origin, direction)
        };
        Ray::new(
            self.to_world.transform_point3(origin),
            self.to_world.transform_vector3(direction).normalize(),
        )
    }
}

/// Where a point is seen on the picture.
#[derive(Clone, Copy, Debug)]
pub struct Connection {
    /// In pixels from the top left of the whole picture.
    pub at: Vec2,
    /// The point of the lens.
    pub lens: Vec3,
    /// Solid-angle density of [`Camera::ray`] towards the point where each picture point is drawn with density 1 per
    /// square pixel, sr⁻¹.
    pub density: f32,
}

impl Camera {
    /// Whether [`connect`](Self::connect) works: not for orthographic cameras.
    pub fn connects(&self) -> bool {
        self.to_camera.is_some()
    }

    /// Where `point` is seen through lens point `lens` (uniform in the unit square); `None` behind the camera.
    pub fn connect(&self, point: Vec3, lens: Vec2) -> Option<Connection> {
        let point = self.to_camera?.transform_point3(point);
        let lens = if self.lens_radius > 0.0 {
            (self.lens_radius * concentric_disk(lens)).extend(0.0)
        } else {
            Vec3::ZERO
        };
        let direction = point - lens;
        let depth = -direction.z;
        if depth <= 0.0 {
            return None;
        }
        // the point of the plane of focus on the same ray, as a viewport point
        let focus = if self.lens_radius > 0.0 { self.focus } else { 1.0 };
        let viewport = (lens + direction * (focus / depth)).truncate() / focus;
        let at = Vec2::new(viewport.x - self.corner.x, self.corner.y - viewport.y) / self.pixel;
        let density = self.density_at(depth / direction.length());
        Some(Connection { at, lens: self.to_world.transform_point3(lens), density })
    }

    /// As [`Connection::density`], of a ray in this direction.
    pub fn density(&self, direction: Vec3) -> f32 {
        self.density_at(-direction.dot(self.to_world.matrix3.z_axis.into()))
    }

    /// dω = cos³θ dA on the viewport at distance 1, for any point of the lens.
    fn density_at(&self, cos: f32) -> f32 {
        1.0 / (self.pixel * self.pixel * cos * cos * cos)
    }
}

fn is_rigid(m: &Affine3A) -> bool {
    let m = m.matrix3;
    (m.transpose() * m).abs_diff_eq(Mat3A::IDENTITY, 1e-4)
}

#[cfg(test)]
mod tests {
    use glam::Mat3;

    use super::*;
    use crate::world::Projection;

    fn camera(projection: Projection, aperture: f32) -> world::Camera {
        let position = Vec3::new(1.0, 2.0, 3.0);
        let z = position.normalize();
        let x = Vec3::Y.cross(z).normalize();
        let to_world = Affine3A::from_mat3_translation(Mat3::from_cols(x, z.cross(x), z), position);
        world::Camera { name: String::new(), node: String::new(), to_world, projection, aperture, focus: 4.0 }
    }

    #[test]
    fn corners_span_the_field_of_view() {
        let c = Camera::new(&camera(Projection::Perspective { vfov: 1.0 }, 0.0), [200, 100]);
        let middle = c.ray(Vec2::new(100.0, 50.0), Vec2::ZERO).direction;
        assert!(middle.abs_diff_eq(-Vec3::new(1.0, 2.0, 3.0).normalize(), 1e-6));
        let (top, bottom) =
            (c.ray(Vec2::new(100.0, 0.0), Vec2::ZERO), c.ray(Vec2::new(100.0, 100.0), Vec2::ZERO));
        assert!((top.direction.angle_between(bottom.direction) - 1.0).abs() < 1e-5);
        assert!(top.direction.y > bottom.direction.y);
        let right = c.ray(Vec2::new(200.0, 50.0), Vec2::ZERO).direction;
        assert!(right.dot(middle.cross(Vec3::Y)) > 0.0, "x grows to the right");
        let half_width = 2.0 * (0.5f32).tan();
        assert!((right.angle_between(middle).tan() - half_width).abs() < 1e-5);
    }

    #[test]
    fn rays_through_the_lens_meet_in_the_plane_of_focus() {
        let c = Camera::new(&camera(Projection::Perspective { vfov: 1.0 }, 0.3), [100, 100]);
        let forward = -Vec3::new(1.0, 2.0, 3.0).normalize();
        let at = Vec2::new(20.0, 70.0);
        let meeting = |lens| {
            let ray = c.ray(at, lens);
            ray.at((4.0 - (ray.origin - Vec3::new(1.0, 2.0, 3.0)).dot(forward)) / ray.direction.dot(forward))
        };
        let first = meeting(Vec2::new(0.5, 0.5));
        for lens in [Vec2::new(0.01, 0.5), Vec2::new(0.9, 0.1), Vec2::new(0.4, 0.99)] {
            assert!(meeting(lens).abs_diff_eq(first, 1e-5));
        }
        let edge = c.ray(at, Vec2::new(0.0, 0.5)).origin.distance(Vec3::new(1.0, 2.0, 3.0));
        assert!((edge - 0.15).abs() < 1e-6, "aperture is a diameter");
    }

    #[test]
    fn points_are_seen_where_their_rays_go_through() {
        for aperture in [0.0, 0.3] {
            let c = Camera::new(&camera(Projection::Perspective { vfov: 1.0 }, aperture), [100, 80]);
            for (at, lens) in
                [(Vec2::new(20.0, 70.0), Vec2::new(0.1, 0.7)), (Vec2::new(99.0, 3.0), Vec2::splat(0.6))]
            {
                let ray = c.ray(at, lens);
                let seen = c.connect(ray.at(2.5), lens).expect("in front");
                assert!(seen.at.abs_diff_eq(at, 1e-3) && seen.lens.abs_diff_eq(ray.origin, 1e-5));
                assert!((seen.density / c.density(ray.direction) - 1.0).abs() < 1e-4);
                // one pixel's share of directions, by three neighbouring rays
                let [right, down] =
                    [Vec2::X, Vec2::Y].map(|step| c.ray(at + 0.1 * step, lens).direction - ray.direction);
                assert!((right.cross(down).length() * seen.density / 0.01 - 1.0).abs() < 1e-2);
                assert!(c.connect(ray.at(-1.0), lens).is_none());
            }
        }
        assert!(!Camera::new(&camera(Projection::Orthographic { half_height: 1.0 }, 0.0), [9, 9]).connects());
    }

    #[test]
    fn orthographic_rays_are_parallel() {
        let c = Camera::new(&camera(Projection::Orthographic { half_height: 2.0 }, 0.0), [100, 50]);
        let (a, b) = (c.ray(Vec2::new(0.0, 0.0), Vec2::ZERO), c.ray(Vec2::new(0.0, 50.0), Vec2::ZERO));
        assert_eq!(a.direction, b.direction);
        assert!((a.origin.distance(b.origin) - 4.0).abs() < 1e-5);
    }
}
