//! Every default of a scene, each with the question that it answers.

/// How many mm is one unit of the mesh?
pub const UNIT: f64 = 1.0;

/// Of what is it made, when nothing is said? The name of a preset.
pub const MATERIAL: &str = "marble";

/// What is the relative index of a medium given by coefficients alone?
pub const ETA: f64 = 1.3;

/// How rough is the boundary? GGX alpha.
pub const ROUGHNESS: f64 = 0.3;

/// From which side does the light come? Degrees around +Y from the viewer's side (+Z)
/// towards +X: from the side, so that forms show, and with them what crosses thin parts.
pub const LIGHT_AZIMUTH: f64 = 40.0;

/// How high does the light stand above the horizon? Degrees.
pub const LIGHT_ELEVATION: f64 = 35.0;

/// How bright is the light? With pi, a white diffuser that faces it has radiance 1.
pub const LIGHT_IRRADIANCE: f64 = std::f64::consts::PI;

/// From which side does the camera look? Degrees, counted like the light's azimuth;
/// a three-quarter view shows the front and one side.
pub const CAMERA_AZIMUTH: f64 = -28.0;

/// How high does the camera stand above the object's middle? Degrees.
pub const CAMERA_ELEVATION: f64 = 4.0;

/// How wide does the camera see? Vertical field of view, degrees.
pub const CAMERA_FOV: f64 = 30.0;

/// How much of the picture's width or height does the object fill, whichever it fills first?
pub const CAMERA_FILL: f64 = 0.9;

/// How large is the picture? Pixels.
pub const SIZE: [u32; 2] = [800, 600];

/// How many samples a pixel does the method `samples` take?
pub const SAMPLES: u32 = 30;

/// How many rings has the method `rings`? Eight squares of doubling size, 1 to 128 texels wide.
pub const RINGS: u32 = 8;

/// How many samples has the march of single scattering? Eight are the knee of error against fetches.
pub const SINGLE: u32 = 8;

/// Does light scattered once go on or turn? As often the one as the other, with coefficients that are
/// already reduced by the mean cosine.
pub const G: f64 = 0.0;

/// How many moments of depth does the method `mixture` read? Three are one texture, a fetch a level.
pub const MOMENTS: u32 = 3;

/// Which share of its width does a split picture draw by the method on its left?
pub const SPLIT_AT: f64 = 0.5;

/// How many texels has a side of the light map?
pub const LIGHT_MAP: u32 = 512;

/// How many frames are averaged?
pub const FRAMES_AVERAGED: u32 = 1;

/// What is radiance multiplied by before it is encoded for display?
pub const EXPOSURE: f64 = 1.0;

/// How many frames a second has an animation? As many as make whole frames of tenths of a second, nearly, and as a GIF
/// can play.
pub const FPS: f64 = 25.0;

/// How many seconds has an animation where nothing in it says so, as a turntable of a still mesh? Slow
/// enough to look.
pub const DURATION: f64 = 4.0;

/// How many frames may a loop have? Each is posed before the first is drawn, to learn what all of them fill, which
/// takes a millisecond or two.
pub const FRAMES_MAX: u32 = 10_000;

/// How many frames of one instant does an animation average? Eight leave no stairs at silhouettes.
pub const FRAMES_AVERAGED_MOVING: u32 = 8;

/// And by the method `samples`? With 32 its noise flickers no more than what it stands for (tests/flicker.rs).
pub const FRAMES_AVERAGED_NOISY: u32 = 32;

/// How many frames may be drawn at once? A number that nobody means is most likely a slip.
pub const FRAMES_DRAWN_MAX: u32 = 1_000_000;
