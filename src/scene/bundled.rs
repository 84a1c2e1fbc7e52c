//! The meshes that ship inside the binary.

use super::{Error, Mesh, obj};

/// A mesh that ships inside the binary.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Bundled {
    /// The statue at about 1,000 triangles.
    Statue1k,
    /// The statue at about 5,000 triangles.
    Statue5k,
    /// The statue at about 20,000 triangles: plain `statue`.
    Statue20k,
}

/// The names by which bundled meshes are asked for.
pub const NAMES: [&str; 4] = ["statue", "statue-1k", "statue-5k", "statue-20k"];

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
            _ => None,
        }
    }

    /// Its full name.
    pub fn name(self) -> &'static str {
        match self {
            Bundled::Statue1k => "statue-1k",
            Bundled::Statue5k => "statue-5k",
            Bundled::Statue20k => "statue-20k",
        }
    }

    /// The mesh itself, in its own unit (1 mm).
    ///
    /// # Errors
    /// None in a binary that passed its tests: they load every bundled mesh.
    pub fn load(self) -> Result<Mesh, Error> {
        let bytes: &[u8] = match self {
            Bundled::Statue1k => asset!("statue-1k.obj"),
            Bundled::Statue5k => asset!("statue-5k.obj"),
            Bundled::Statue20k => asset!("statue-20k.obj"),
        };
        obj::parse(bytes, self.name())
    }
}
