//! Where the Monte Carlo method puts its samples.

mod blue_noise;
mod radius;
mod sequence;

pub use blue_noise::{NOISE_SIZE, blue_noise, noise};
pub use radius::{MIN_SIGMA_TR, RadiusSampler, pdf_area, sample_radius, solve};
pub use sequence::{GOLDEN, R2, r2};
