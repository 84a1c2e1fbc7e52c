//! How a texture is read and what its texels are: what the price of a fetch depends on.

use super::{Declared, Filter};

/// A kind of fetch, and the format that it reads.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Access {
    /// A bilinear tap of RGBA32F.
    BilinearRgba,
    /// A bilinear tap of R32F.
    BilinearScalar,
    /// The nearest texel of RGBA32F, through a sampler.
    NearestRgba,
    /// The nearest texel of D32, through a sampler.
    NearestDepth,
    /// A texel of RGBA32F by its coordinates.
    TexelRgba,
    /// A texel of RG32F by its coordinates.
    TexelPair,
    /// 2x2 texels of D32 at once, compared.
    Gather,
    /// A trilinear tap of R32F.
    Trilinear,
    /// A texel of a storage image, RGBA32F.
    StorageRgba,
    /// A texel of a storage image, R32F.
    StorageScalar,
}

impl Access {
    /// All kinds.
    pub const ALL: [Access; 10] = [
        Access::BilinearRgba,
        Access::BilinearScalar,
        Access::NearestRgba,
        Access::NearestDepth,
        Access::TexelRgba,
        Access::TexelPair,
        Access::Gather,
        Access::Trilinear,
        Access::StorageRgba,
        Access::StorageScalar,
    ];

    /// The kind in words.
    pub fn kind(self) -> &'static str {
        match self {
            Access::BilinearRgba | Access::BilinearScalar => "bilinear",
            Access::NearestRgba | Access::NearestDepth => "nearest",
            Access::TexelRgba | Access::TexelPair => "texel",
            Access::Gather => "gather and compare",
            Access::Trilinear => "trilinear",
            Access::StorageRgba | Access::StorageScalar => "storage image",
        }
    }

    /// The format in words.
    pub fn format(self) -> &'static str {
        match self {
            Access::BilinearRgba
            | Access::NearestRgba
            | Access::TexelRgba
            | Access::StorageRgba => "RGBA32F",
            Access::BilinearScalar | Access::Trilinear | Access::StorageScalar => "R32F",
            Access::TexelPair => "RG32F",
            Access::NearestDepth | Access::Gather => "D32",
        }
    }

    /// Bytes of a texel.
    pub fn bytes(self) -> u32 {
        match self.format() {
            "RGBA32F" => 16,
            "RG32F" => 8,
            _ => 4,
        }
    }

    /// Texels that one fetch touches.
    pub fn texels(self) -> u32 {
        match self {
            Access::BilinearRgba | Access::BilinearScalar | Access::Gather => 4,
            Access::Trilinear => 8,
            _ => 1,
        }
    }

    /// Whether the sampler interpolates.
    pub fn filters(self) -> bool {
        matches!(
            self,
            Access::BilinearRgba | Access::BilinearScalar | Access::Trilinear
        )
    }
}

impl Declared {
    /// How its reads are made on a device that filters as `filter`; none of input attachments and buffers.
    pub fn access(&self, filter: Filter) -> Option<Access> {
        if self.term == super::INPUT || self.term == super::BUFFER {
            return None;
        }
        let access = match (self.shader, self.texture) {
            ("decimate.comp" | "smooth.comp" | "boxes.comp", "fourth" | "source_fourth") => {
                Access::StorageScalar
            }
            ("decimate.comp" | "smooth.comp" | "boxes.comp", _) => Access::StorageRgba,
            ("exact.comp", "radiance") => Access::StorageRgba,
            ("exact.comp", "view_depth" | "view_normal") => Access::TexelPair,
            ("exact.comp" | "volume.comp", _) => Access::TexelRgba,
            (_, "light_depth") => Access::Gather,
            (_, "blue_noise") => Access::TexelPair,
            (_, "smoothed_fourth") => Access::BilinearScalar,
            (_, "volumes") => Access::Trilinear,
            (_, "exits") if self.what.contains("depth") => Access::NearestDepth,
            _ if self.what.contains("bilinear") => Access::BilinearRgba,
            _ => Access::NearestRgba,
        };
        Some(match (access, filter) {
            // Where nothing filters each texel of a tap is a fetch of its own.
            (Access::BilinearRgba, Filter::Texels) => Access::NearestRgba,
            (Access::BilinearScalar | Access::Trilinear, Filter::Texels) => Access::NearestDepth,
            _ => access,
        })
    }
}
