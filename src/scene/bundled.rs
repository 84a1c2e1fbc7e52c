//! The meshes that ship inside the binary.

use super::{Error, Mesh, Model, gltf, obj};

/// A mesh that ships inside the binary.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Bundled {
    /// The statue at about 1,000 triangles.
    Statue1k,
    /// The statue at about 5,000 triangles.
    Statue5k,
    /// The statue at about 20,000 triangles: plain `statue`.
    Statue20k,
    /// A fighting fish of 15,600 triangles that swims and hovers.
    Betta,
}

/// The names by which bundled meshes are asked for.
pub const NAMES: [&str; 5] = ["statue", "statue-1k", "statue-5k", "statue-20k", "betta"];

macro_rules! asset {
    ($file:literal) => {
        include_bytes!(concat!(env!("CARGO_MANIFEST_DIR"), "/assets/", $file))
    };
}

impl Bundled {
    /// The bundled mesh called `name`, if there is one.
    pub fn named(name: &str) -> Option<Bundled> {
        match name {
            "statue-1k" => Some(Bundled::Statue1k),
            "statue-5k" => Some(Bundled::Statue5k),
            "statue" | "statue-20k" => Some(Bundled::Statue20k),
            "betta" => Some(Bundled::Betta),
            _ => None,
        }
    }

    /// Its full name.
    pub fn name(self) -> &'static str {
        match self {
            Bundled::Statue1k => "statue-1k",
            Bundled::Statue5k => "statue-5k",
            Bundled::Statue20k => "statue-20k",
            Bundled::Betta => "betta",
        }
    }

    /// The mesh as it is at rest, in its own unit (1 mm).
    ///
    /// # Errors
    /// As [`Bundled::load`].
    pub fn mesh(self) -> Result<Mesh, Error> {
        let model = self.load()?;
        Ok(model.posed(&model.pose(1.0, 0, None, 0.0)))
    }

    /// The mesh itself, in its own unit (1 mm), and what moves it.
    ///
    /// # Errors
    /// None in a binary that passed its tests: they load every bundled mesh.
    pub fn load(self) -> Result<Model, Error> {
        let bytes: &[u8] = match self {
            Bundled::Statue1k => asset!("statue-1k.obj"),
            Bundled::Statue5k => asset!("statue-5k.obj"),
            Bundled::Statue20k => asset!("statue-20k.obj"),
            Bundled::Betta => return gltf::parse(asset!("betta.glb"), self.name(), None),
        };
        Ok(Model::of(obj::parse(bytes, self.name())?))
    }
}
