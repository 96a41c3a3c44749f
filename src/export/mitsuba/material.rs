//! Materials as BSDFs: mask(normalmap(twosided(…))), of which each layer is there where it is needed.
//!
//! `twosided` lies within `normalmap`, so that the back of a surface has the mapped normal turned round; `mask` lies outside,
//! since nothing that lets light through fits into the others.

use glam::Vec3;

use super::{Exporter, energy, xml::Node};
use crate::{
    export::{Error, fuzz},
    world::{
        Alpha, ColorInput, Fresnel, Material, MaterialId, MetalFinish, NormalMap, Pbr, ScalarInput, Surface,
    },
};

/// Below this α rayo's metals and dielectrics are smooth.
const SMOOTH: f32 = 1e-3;
/// Below this fuzz the lobe is a mirror.
const MIN_FUZZ: f32 = 1e-4;
/// Where α |ior − 1| is less, a rough boundary is smooth.
const MIN_SPREAD: f32 = 1e-4;

/// How often the base of a plastic is picked, rather than its layer.
const BASE_SHARE: f32 = 0.7;

/// What of a shape its BSDF depends on.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Variant {
    /// The shape has vertex colours, and the material uses them.
    pub colored: bool,
    /// Bitangents turn the other way; only where there is a normal map.
    pub mirrored: bool,
}

impl Exporter<'_> {
    /// The id of a material's BSDF, written to the scene at first use.
    pub fn bsdf(&mut self, id: MaterialId, variant: Variant) -> Result<String, Error> {
        let world = self.world;
        let material = &world.model.materials[id.index()];
        let variant = Variant { mirrored: variant.mirrored && material.normal.is_some(), ..variant };
        if let Some(name) = self.bsdfs.get(&(id, variant)) {
            return Ok(name.clone());
        }
        let body = self.body(material, variant)?;
        let mut bsdf = match material.surface {
            Surface::Dielectric { .. } => body,
            _ => Node::plugin("bsdf", "twosided").child(body),
        };
        let bends = !matches!(material.surface, Surface::Unlit { .. } | Surface::Black);
        if let Some(map) = material.normal.filter(|_| bends) {
            bsdf = self.bent(material, &map, variant, bsdf)?;
        }
        bsdf = self.covered(material, variant, bsdf)?;
        let name = self.names.unique("m", &material.name);
        self.nodes.push(bsdf.attribute("id", &name));
        self.bsdfs.insert((id, variant), name.clone());
        Ok(name)
    }

    fn body(&mut self, material: &Material, variant: Variant) -> Result<Node, Error> {
        Ok(match &material.surface {
            Surface::Diffuse { color } => {
                Node::plugin("bsdf", "diffuse").child(self.tint("reflectance", material, variant, color)?)
            }
            Surface::Metal { color, finish: MetalFinish::Fuzz(fuzz) } if *fuzz < MIN_FUZZ => {
                self.mirror(material, variant, color)?
            }
            Surface::Metal { color, finish: MetalFinish::Fuzz(fuzz) } => {
                self.notes.approximated(
                    subject(material),
                    "Mitsuba has no fuzzy mirror; it is a metal of Beckmann facets with α = 0.35 fuzz, which share 82 to \
                     99 % of the light seen head on; fuzz loses more towards grazing angles",
                );
                Node::plugin("bsdf", "roughconductor")
                    .string("material", "none")
                    .string("distribution", "beckmann")
                    .float("alpha", fuzz::beckmann_alpha(*fuzz))
                    .child(self.tint("specular_reflectance", material, variant, color)?)
            }
            Surface::Metal { color, finish: MetalFinish::Roughness { roughness, fresnel, multiscatter } } => {
                self.metal(material, variant, color, roughness, *fresnel, *multiscatter)?
            }
            Surface::Dielectric { ior, fresnel, roughness, tint } => {
                self.dielectric(material, variant, *ior, *fresnel, roughness, tint)?
            }
            Surface::Pbr(pbr) => self.pbr(material, variant, pbr)?,
            // `layers` has replaced those with layers.
            Surface::Unlit { .. } | Surface::Black | Surface::Layered(_) | Surface::SpecularGlossiness(_) => {
                Node::plugin("bsdf", "diffuse").child(Node::rgb("reflectance", Vec3::ZERO))
            }
        })
    }

    fn mirror(&mut self, material: &Material, variant: Variant, color: &ColorInput) -> Result<Node, Error> {
        let tint = self.tint("specular_reflectance", material, variant, color)?;
        Ok(Node::plugin("bsdf", "conductor").string("material", "none").child(tint))
    }

    fn metal(
        &mut self,
        material: &Material,
        variant: Variant,
        color: &ColorInput,
        roughness: &ScalarInput,
        fresnel: Fresnel,
        multiscatter: bool,
    ) -> Result<Node, Error> {
        let schlick = fresnel != Fresnel::Constant;
        let constant = roughness.texture.is_none().then_some(roughness.factor.clamp(0.0, 1.0));
        let smooth = constant.is_some_and(|r| r * r < SMOOTH);
        if smooth && !schlick {
            return self.mirror(material, variant, color);
        }
        if smooth {
            self.notes.approximated(
                subject(material),
                "a perfect mirror with Schlick's curve is a rough one with α = 0.001 (a lobe 2 mrad wide); Mitsuba's smooth \
                 metals have other curves",
            );
        } else {
            self.note_masking(material);
        }
        let painted = self.is_painted(variant, color);
        match constant {
            Some(roughness) if !painted && (!schlick || roughness >= energy::SCALED_FROM) => {
                let alpha = roughness * roughness;
                if multiscatter || schlick {
                    self.notes.approximated(
                        subject(material),
                        "light between facets, which Mitsuba leaves out, is given back as diffuse of albedo Ē − Ē₁, so that the \
                         albedo over the hemisphere is ours; of Schlick's curve the mean is taken, so that colours do not \
                         fade to white at grazing angles",
                    );
                }
                let metal = energy::Metal::new(alpha, schlick, multiscatter);
                let key = format!("metal {alpha} {schlick} {multiscatter}");
                let facets = Node::plugin("bsdf", "roughconductor")
                    .string("material", "none")
                    .string("distribution", "ggx")
                    .float("alpha", alpha)
                    .child(self.shaded("specular_reflectance", color, &key, |c| metal.facets(c))?);
                if metal.weight == 0.0 {
                    return Ok(facets);
                }
                let key = format!("further {key}");
                let further = self.shaded("reflectance", color, &key, |c| metal.further(c))?;
                Ok(Node::plugin("bsdf", "blendbsdf")
                    .float("weight", metal.weight)
                    .child(facets)
                    .child(Node::plugin("bsdf", "diffuse").child(further)))
            }
            _ if !schlick => {
                if multiscatter {
                    self.note_single(material);
                }
                Ok(Node::plugin("bsdf", "roughconductor")
                    .string("material", "none")
                    .string("distribution", "ggx")
                    .child(self.scalar("alpha", roughness, "square", |r| (r * r).max(SMOOTH))?)
                    .child(self.tint("specular_reflectance", material, variant, color)?))
            }
            _ => {
                if multiscatter && !smooth {
                    self.note_single(material);
                }
                Ok(Node::plugin("bsdf", "principled")
                    .child(self.tint("base_color", material, variant, color)?)
                    .float("metallic", 1.0)
                    .child(self.scalar("roughness", roughness, "value", |r| r)?))
            }
        }
    }

    fn dielectric(
        &mut self,
        material: &Material,
        variant: Variant,
        ior: f32,
        fresnel: Fresnel,
        roughness: &ScalarInput,
        tint: &ColorInput,
    ) -> Result<Node, Error> {
        if fresnel == Fresnel::Schlick {
            self.notes.approximated(
                subject(material),
                "reflects by the equations of Fresnel; Mitsuba's dielectrics have no Schlick curve R₀ + (1 − R₀)(1 − cos θ)⁵",
            );
        }
        let alpha = roughness.factor.clamp(0.0, 1.0).powi(2);
        let smooth = alpha < SMOOTH || alpha * (ior - 1.0).abs() < MIN_SPREAD;
        let kind = if smooth { "dielectric" } else { "roughdielectric" };
        let mut node = Node::plugin("bsdf", kind).float("int_ior", ior).float("ext_ior", 1.0);
        if !smooth {
            self.note_masking(material);
            self.notes.approximated(
                subject(material),
                "light that bounces between the facets of rough glass is lost: at α = 1 and index 1.5 up to half of it",
            );
            node = node.string("distribution", "ggx");
            node = node.child(self.scalar("alpha", roughness, "square", |r| (r * r).max(SMOOTH))?);
        }
        for name in ["specular_reflectance", "specular_transmittance"] {
            node = node.child(self.tint(name, material, variant, tint)?);
        }
        Ok(node)
    }

    fn pbr(&mut self, material: &Material, variant: Variant, pbr: &Pbr) -> Result<Node, Error> {
        let metallic = &pbr.metallic;
        let all_metal = metallic.texture.is_none() && metallic.factor >= 1.0;
        let no_metal = metallic.factor <= 0.0;
        if all_metal {
            let (color, roughness) = (&pbr.base_color, &pbr.roughness);
            return self.metal(material, variant, color, roughness, Fresnel::Schlick, pbr.multiscatter);
        }
        if pbr.roughness.texture.is_some() {
            return self.principled(material, variant, pbr);
        }
        let plastic = self.plastic(material, variant, pbr)?;
        if no_metal {
            return Ok(plastic);
        }
        let metal = self.metal(
            material,
            variant,
            &pbr.base_color,
            &pbr.roughness,
            Fresnel::Schlick,
            pbr.multiscatter,
        )?;
        let weight = self.scalar("weight", metallic, "value", |m| m)?;
        Ok(Node::plugin("bsdf", "blendbsdf").child(weight).child(plastic).child(metal))
    }

    /// The dielectric part: base (1 − E(wo)) (1 − E(wi)) / (π (1 − mean of E)) under the layer, E its albedo.
    fn plastic(&mut self, material: &Material, variant: Variant, pbr: &Pbr) -> Result<Node, Error> {
        let alpha = pbr.roughness.factor.clamp(0.0, 1.0).powi(2);
        let ior = 1f32.max(pbr.ior).max(1.0 / pbr.ior);
        if ior < 1.0 + 1e-4 {
            let base = self.tint("reflectance", material, variant, &pbr.base_color)?;
            return Ok(Node::plugin("bsdf", "diffuse").child(base));
        }
        self.notes.approximated(
            subject(material),
            "the base under the layer, here base (1 − E(wo)) / π with E the layer's albedo, is base (1 − Ē) / π (below roughness \
             0.3: base T(wo) T(wi) / (π T̄), with T what one scattering lets through), Ē and T̄ being means over the hemisphere; \
             the layer's facets scatter once, scaled to the same Ē",
        );
        let kind = if alpha < SMOOTH { "plastic" } else { "roughplastic" };
        let mut node = Node::plugin("bsdf", kind).float("int_ior", ior).float("ext_ior", 1.0);
        if alpha < SMOOTH {
            return Ok(node.child(self.tint("diffuse_reflectance", material, variant, &pbr.base_color)?));
        }
        let factors = energy::Plastic::new(alpha, ior, pbr.multiscatter);
        node = node.string("distribution", "ggx").float("alpha", alpha);
        let color = &pbr.base_color;
        if alpha < energy::PLAIN_BASE_FROM.powi(2) {
            let base = self.scaled("diffuse_reflectance", material, variant, color, factors.diffuse)?;
            return Ok(node
                .child(Node::unbounded("specular_reflectance", Vec3::splat(factors.specular)))
                .child(base));
        }
        let specular = Vec3::splat(factors.specular / (1.0 - BASE_SHARE));
        let layer = node
            .child(Node::unbounded("specular_reflectance", specular))
            .child(Node::rgb("diffuse_reflectance", Vec3::ZERO));
        let base = self.scaled("reflectance", material, variant, color, factors.rest / BASE_SHARE)?;
        let base = Node::plugin("bsdf", "diffuse").child(base);
        Ok(Node::plugin("bsdf", "blendbsdf").float("weight", BASE_SHARE).child(layer).child(base))
    }

    /// A colour of the surface times a number.
    fn scaled(
        &mut self,
        name: &str,
        material: &Material,
        variant: Variant,
        color: &ColorInput,
        scale: f32,
    ) -> Result<Node, Error> {
        if self.is_painted(variant, color) {
            return Ok(painted(name, "vertex_color").float("scale", scale));
        }
        if variant.colored {
            self.note_unpainted(material);
        }
        self.shaded(name, color, &format!("times {scale}"), |c| scale * c)
    }

    fn note_unpainted(&mut self, material: &Material) {
        self.notes.approximated(
            subject(material),
            "vertex colours are left out where there is a texture: Mitsuba cannot multiply them",
        );
    }

    /// Whether vertex colours are all the colour there is.
    fn is_painted(&self, variant: Variant, color: &ColorInput) -> bool {
        variant.colored && color.texture.is_none()
    }

    /// Where roughness varies, which Mitsuba's plastics cannot.
    fn principled(&mut self, material: &Material, variant: Variant, pbr: &Pbr) -> Result<Node, Error> {
        self.notes.approximated(
            subject(material),
            "roughness varies, so it is Mitsuba's `principled`: its base is Disney's diffuse, (1 − F/2)(1 − F'/2) and \
             retro-reflection, not dimmed by the layer, where rayo has 1 − E(wo); its facets scatter once only",
        );
        let ior = 1f32.max(pbr.ior).max(1.0 / pbr.ior);
        Ok(Node::plugin("bsdf", "principled")
            .child(self.tint("base_color", material, variant, &pbr.base_color)?)
            .child(self.scalar("metallic", &pbr.metallic, "value", |m| m)?)
            .child(self.scalar("roughness", &pbr.roughness, "value", |r| r)?)
            .float("eta", ior))
    }

    fn bent(
        &mut self,
        material: &Material,
        map: &NormalMap,
        variant: Variant,
        bsdf: Node,
    ) -> Result<Node, Error> {
        self.notes.approximated(
            subject(material),
            "the normal map lies in the frame of ∂p/∂u of each triangle, not in interpolated MikkTSpace tangents; normals \
             that lean out of sight are turned round, and those that mirror into the surface are black, where rayo bends \
             them back",
        );
        let normals = self.normals("normalmap", &map.texture, map.scale, variant.mirrored)?;
        Ok(Node::plugin("bsdf", "normalmap")
            .boolean("use_shadowing_function", false)
            .child(normals)
            .child(bsdf))
    }

    fn covered(&mut self, material: &Material, variant: Variant, bsdf: Node) -> Result<Node, Error> {
        let opacity = match material.alpha {
            Alpha::Opaque => return Ok(bsdf),
            _ if variant.colored && material.coverage.texture.is_some() => {
                self.notes.approximated(
                    subject(material),
                    "vertex alpha is left out where a texture has alpha too: Mitsuba cannot multiply them",
                );
                self.opacity(material)?
            }
            Alpha::Blend if variant.colored => painted("opacity", "vertex_opacity"),
            _ => self.opacity(material)?,
        };
        if material.emission.is_some() || matches!(material.surface, Surface::Unlit { .. }) {
            self.notes.approximated(
                subject(material),
                "what it gives off is not covered with the rest: emitters know no opacity in Mitsuba",
            );
        }
        Ok(Node::plugin("bsdf", "mask").child(opacity).child(bsdf))
    }

    fn opacity(&mut self, material: &Material) -> Result<Node, Error> {
        match material.alpha {
            Alpha::Mask { cutoff } => {
                if material.coverage.texture.is_some() {
                    self.notes.approximated(
                        subject(material),
                        "alpha is cut at a quarter of a texel; Mitsuba compares nothing with a cutoff",
                    );
                }
                self.cut_out("opacity", &material.coverage, cutoff)
            }
            _ => self.scalar("opacity", &material.coverage, "value", |a| a),
        }
    }

    /// A colour of the surface, times the vertex colour where that is all there is.
    fn tint(
        &mut self,
        name: &str,
        material: &Material,
        variant: Variant,
        color: &ColorInput,
    ) -> Result<Node, Error> {
        if !variant.colored {
            return self.reflectance(name, color);
        }
        if self.is_painted(variant, color) {
            return Ok(painted(name, "vertex_color"));
        }
        self.note_unpainted(material);
        self.reflectance(name, color)
    }

    fn note_masking(&mut self, material: &Material) {
        self.notes.approximated(
            subject(material),
            "facets hide each other by G₁(wo) G₁(wi), as if independently; rayo has Smith's height-correlated G₂ = 1 / (1 + \
             Λ(wo) + Λ(wi)), which is brighter where both directions graze",
        );
    }

    fn note_single(&mut self, material: &Material) {
        self.notes.approximated(
            subject(material),
            "facets scatter once only: of white, a share of 1 − E(α) is lost (0.2 % at roughness 0.3, 5 % at 0.6, more than \
             half at 1)",
        );
    }
}

/// The colour that a surface multiplies with vertex colours.
pub fn base(material: &Material) -> Option<&ColorInput> {
    match &material.surface {
        Surface::Diffuse { color } | Surface::Metal { color, .. } | Surface::Unlit { color } => Some(color),
        Surface::Dielectric { tint, .. } => Some(tint),
        Surface::Pbr(pbr) => Some(&pbr.base_color),
        Surface::Black | Surface::Layered(_) | Surface::SpecularGlossiness(_) => None,
    }
}

pub fn subject(material: &Material) -> String {
    format!("material `{}`", material.name)
}

fn painted(name: &str, attribute: &str) -> Node {
    Node::plugin("texture", "mesh_attribute").named(name).string("name", attribute)
}
