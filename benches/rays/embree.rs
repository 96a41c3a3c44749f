//! The few functions of Embree 4 that the race needs, from its shared library (API: <https://www.embree.org/api.html>).

use std::{
    ffi::{CString, c_char, c_int, c_uint, c_void},
    mem::ManuallyDrop,
    path::Path,
    ptr::null_mut,
};

use glam::{Affine3A, Vec3};
use libloading::Library;
use rayo::geometry::Ray;

use crate::scenes::World;

type Handle = *mut c_void;

const TRIANGLES: c_int = 0;
const INSTANCE: c_int = 121;
const INDEX_BUFFER: c_int = 0;
const VERTEX_BUFFER: c_int = 1;
const UINT3: c_int = 0x5003;
const FLOAT3: c_int = 0x9003;
const FLOAT3X4_COLUMNS: c_int = 0x9234;
const ROBUST: c_int = 4;
const NONE: u32 = u32::MAX;

#[derive(Clone, Copy)]
pub enum Quality {
    Medium = 1,
    High = 2,
}

#[derive(Clone, Copy)]
#[repr(C, align(16))]
struct RtcRay {
    origin: [f32; 3],
    t_near: f32,
    direction: [f32; 3],
    time: f32,
    t_far: f32,
    mask: u32,
    id: u32,
    flags: u32,
}

/// (Some room behind: how many instance numbers follow depends on how the library was built.)
#[repr(C, align(16))]
struct RtcRayHit {
    ray: RtcRay,
    normal: [f32; 3],
    u: f32,
    v: f32,
    primitive: u32,
    geometry: u32,
    instances: [u32; 9],
}

/// Named as in the API, less `rtc`.
macro_rules! functions {
    ($($name:ident: $symbol:literal, fn($($argument:ty),*) $(-> $result:ty)?;)*) => {
        struct Functions {
            $($name: unsafe extern "C" fn($($argument),*) $(-> $result)?,)*
        }

        impl Functions {
            fn new(library: &Library) -> Result<Self, libloading::Error> {
                // SAFETY: the types are those of Embree 4's headers.
                Ok(Self { $($name: *unsafe { library.get($symbol) }?,)* })
            }
        }
    };
}

functions! {
    new_device: b"rtcNewDevice", fn(*const c_char) -> Handle;
    release_device: b"rtcReleaseDevice", fn(Handle);
    device_error: b"rtcGetDeviceError", fn(Handle) -> c_int;
    new_scene: b"rtcNewScene", fn(Handle) -> Handle;
    release_scene: b"rtcReleaseScene", fn(Handle);
    set_scene_flags: b"rtcSetSceneFlags", fn(Handle, c_int);
    set_scene_quality: b"rtcSetSceneBuildQuality", fn(Handle, c_int);
    commit_scene: b"rtcCommitScene", fn(Handle);
    new_geometry: b"rtcNewGeometry", fn(Handle, c_int) -> Handle;
    release_geometry: b"rtcReleaseGeometry", fn(Handle);
    commit_geometry: b"rtcCommitGeometry", fn(Handle);
    attach_geometry: b"rtcAttachGeometry", fn(Handle, Handle) -> c_uint;
    set_buffer: b"rtcSetSharedGeometryBuffer", fn(Handle, c_int, c_uint, c_int, *const c_void, usize, usize, usize);
    set_instanced: b"rtcSetGeometryInstancedScene", fn(Handle, Handle);
    set_transform: b"rtcSetGeometryTransform", fn(Handle, c_uint, c_int, *const c_void);
    intersect: b"rtcIntersect1", fn(Handle, *mut RtcRayHit, *mut c_void);
    occluded: b"rtcOccluded1", fn(Handle, *mut RtcRay, *mut c_void);
}

pub struct Embree {
    functions: Functions,
    device: Handle,
    /// Stays loaded: its threads outlive the device.
    _library: ManuallyDrop<Library>,
}

impl Embree {
    /// `threads`: of the builders.
    pub fn load(path: &Path, threads: usize) -> Result<Self, String> {
        // SAFETY: Embree's initialisers ask nothing of who loads it.
        let library = unsafe { Library::new(path) }.map_err(|e| e.to_string())?;
        let functions = Functions::new(&library).map_err(|e| e.to_string())?;
        let config = CString::new(format!("threads={threads}")).map_err(|e| e.to_string())?;
        // SAFETY: a terminated string.
        let device = unsafe { (functions.new_device)(config.as_ptr()) };
        match device.is_null() {
            true => Err("Embree makes no device".into()),
            false => Ok(Self { functions, device, _library: ManuallyDrop::new(library) }),
        }
    }

    /// A world of one mesh that is not moved is built without instances. Buffers are shared: `world` must stay.
    pub fn build<'a>(&'a self, world: &'a World, quality: Quality, robust: bool) -> Scene<'a> {
        let mut scenes: Vec<Handle> = Vec::new();
        if let ([mesh], [(0, place)]) = (&world.meshes[..], &world.instances[..])
            && *place == Affine3A::IDENTITY
        {
            scenes.push(self.scene(quality, robust, |scene| self.attach_mesh(scene, mesh)));
        } else {
            for mesh in &world.meshes {
                scenes.push(self.scene(quality, robust, |scene| self.attach_mesh(scene, mesh)));
            }
            let top = self.scene(quality, robust, |scene| {
                for (mesh, to_world) in &world.instances {
                    self.attach_instance(scene, scenes[*mesh], to_world);
                }
            });
            scenes.push(top);
        }
        // SAFETY: the device lives.
        let error = unsafe { (self.functions.device_error)(self.device) };
        assert_eq!(error, 0, "Embree reports an error");
        Scene { embree: self, scenes }
    }

    fn scene(&self, quality: Quality, robust: bool, attach: impl FnOnce(Handle)) -> Handle {
        let f = &self.functions;
        // SAFETY: handles from this device.
        unsafe {
            let scene = (f.new_scene)(self.device);
            (f.set_scene_flags)(scene, if robust { ROBUST } else { 0 });
            (f.set_scene_quality)(scene, quality as c_int);
            attach(scene);
            (f.commit_scene)(scene);
            scene
        }
    }

    fn attach_mesh(&self, scene: Handle, mesh: &crate::scenes::Mesh) {
        let f = &self.functions;
        // SAFETY: both buffers outlive the scene, since it borrows the world; Embree reads 16 bytes at the last
        // position, and `Mesh` has one more behind it.
        unsafe {
            let geometry = (f.new_geometry)(self.device, TRIANGLES);
            let positions = mesh.padded_positions();
            let count = mesh.positions().len();
            (f.set_buffer)(geometry, VERTEX_BUFFER, 0, FLOAT3, positions.as_ptr().cast(), 0, 12, count);
            let triangles = &mesh.triangles;
            (f.set_buffer)(
                geometry,
                INDEX_BUFFER,
                0,
                UINT3,
                triangles.as_ptr().cast(),
                0,
                12,
                triangles.len(),
            );
            (f.commit_geometry)(geometry);
            (f.attach_geometry)(scene, geometry);
            (f.release_geometry)(geometry);
        }
    }

    fn attach_instance(&self, scene: Handle, mesh: Handle, to_world: &Affine3A) {
        let f = &self.functions;
        let columns = to_world.to_cols_array();
        // SAFETY: handles from this device; the transform is copied.
        unsafe {
            let geometry = (f.new_geometry)(self.device, INSTANCE);
            (f.set_instanced)(geometry, mesh);
            (f.set_transform)(geometry, 0, FLOAT3X4_COLUMNS, columns.as_ptr().cast());
            (f.commit_geometry)(geometry);
            (f.attach_geometry)(scene, geometry);
            (f.release_geometry)(geometry);
        }
    }
}

impl Drop for Embree {
    fn drop(&mut self) {
        // SAFETY: made in `load`; scenes borrow, so none is left.
        unsafe { (self.functions.release_device)(self.device) }
    }
}

/// The last scene is the one that rays go through.
pub struct Scene<'a> {
    embree: &'a Embree,
    scenes: Vec<Handle>,
}

impl Scene<'_> {
    /// t of the nearest hit, infinite where there is none.
    #[inline]
    pub fn closest(&self, ray: &Ray) -> f32 {
        let mut hit = RtcRayHit {
            ray: rtc(ray),
            normal: Vec3::ZERO.to_array(),
            u: 0.0,
            v: 0.0,
            primitive: NONE,
            geometry: NONE,
            instances: [NONE; 9],
        };
        // SAFETY: a committed scene, and a ray as the API lays it out.
        unsafe { (self.embree.functions.intersect)(self.top(), &mut hit, null_mut()) };
        if hit.geometry == NONE { f32::INFINITY } else { hit.ray.t_far }
    }

    #[inline]
    pub fn occluded(&self, ray: &Ray) -> bool {
        let mut ray = rtc(ray);
        // SAFETY: as above.
        unsafe { (self.embree.functions.occluded)(self.top(), &mut ray, null_mut()) };
        ray.t_far < 0.0
    }

    #[inline]
    fn top(&self) -> Handle {
        self.scenes[self.scenes.len() - 1]
    }
}

impl Drop for Scene<'_> {
    fn drop(&mut self) {
        for &scene in &self.scenes {
            // SAFETY: made in `Embree::build`, released once.
            unsafe { (self.embree.functions.release_scene)(scene) }
        }
    }
}

#[inline]
fn rtc(ray: &Ray) -> RtcRay {
    RtcRay {
        origin: ray.origin.to_array(),
        t_near: ray.t_min,
        direction: ray.direction.to_array(),
        time: 0.0,
        t_far: ray.t_max,
        mask: NONE,
        id: 0,
        flags: 0,
    }
}
