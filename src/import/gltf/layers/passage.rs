//! KHR_materials_transmission, KHR_materials_volume, KHR_materials_dispersion and KHR_materials_diffuse_transmission.

use super::Reader;
use crate::world::{DiffuseTransmission, Layered, Volume};

/// An Abbe number of 0.02.
const MAX_DISPERSION: f32 = 1000.0;

pub fn transmission(reader: &mut Reader, layered: &mut Layered) {
    let factor = reader.scalar_input("transmissionFactor", 0.0, ("transmissionTexture", 0));
    layered.transmission = (factor.factor > 0.0).then_some(factor);
}

pub fn diffuse_transmission(reader: &mut Reader, layered: &mut Layered) {
    let factor = reader.scalar_input("diffuseTransmissionFactor", 0.0, ("diffuseTransmissionTexture", 3));
    if factor.factor > 0.0 {
        let color =
            reader.color_input("diffuseTransmissionColorFactor", 1.0, 1.0, "diffuseTransmissionColorTexture");
        layered.diffuse_transmission = Some(DiffuseTransmission { factor, color });
    }
}

/// A thickness of 0 means a wall, not a volume.
pub fn volume(reader: &mut Reader, layered: &mut Layered) {
    let thickness = reader.number("thicknessFactor", 0.0, [0.0, f32::MAX]);
    let color = reader.color::<3>("attenuationColor", 1.0, 1.0);
    let distance = reader.number("attenuationDistance", f32::INFINITY, [f32::MIN_POSITIVE, f32::INFINITY]);
    if thickness > 0.0 {
        layered.volume =
            Some(Volume { attenuation_color: color.into(), attenuation_distance: distance.max(1e-9) });
    }
}

/// Read after the volume that it needs.
pub fn dispersion(reader: &mut Reader, layered: &mut Layered) {
    layered.dispersion = reader.number("dispersion", 0.0, [0.0, MAX_DISPERSION]);
    if layered.dispersion > 0.0 && layered.volume.is_none() {
        reader.warn("dispersion", "has no effect without KHR_materials_volume of some thickness");
    }
}
