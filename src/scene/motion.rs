//! What moves in a scene, as a function of the number of a frame and of nothing else.
//!
//! An animation is a loop of [`Motion::frames`] frames: frame n is the instant n / frames of its duration, and frame
//! n + frames is frame n again. So any range of frames may be drawn by any process.
//!
//! The light map has one scale for all of them. Its texels, its depth range and with them the levels and weights of the
//! mixture are those of the widest frame; its place follows the mesh of each frame, in whole texels. A grid that moved by
//! less, or whose texels grew and shrank, would swim over what stands still.

use std::sync::Arc;

use super::framing::Turned;
use super::keys::Track;
use super::{
    Camera, Clip, Deformer, Error, Light, LightFrame, Mesh, Model, Pose, Viewpoint, defaults,
};
use glam::DVec3;
use rayon::prelude::*;

/// What moves, as a scene file and flags ask for it.
#[derive(Clone, Debug, PartialEq)]
pub struct Animation {
    /// The clip of a rigged mesh; none for its first.
    pub clip: Option<String>,
    /// Frames a second.
    pub fps: f64,
    /// Seconds; none for the longest of what moves.
    pub duration: Option<f64>,
    /// What bends the mesh, in turn; at most [`super::deformer::DEFORMERS_MAX`].
    pub deformers: Vec<Deformer>,
    /// Turns of the light about the vertical over the duration.
    pub light_turns: f64,
    /// Azimuth, elevation (degrees), irradiance and colour of the light.
    pub light_keys: Option<Track<6>>,
    /// Turns of the camera about the vertical through its target over the duration.
    pub camera_turns: f64,
    /// Keyframes of the camera.
    pub camera_keys: Option<CameraKeys>,
}

/// Keyframes of a camera that orbits a target.
#[derive(Clone, Debug, PartialEq)]
pub struct CameraKeys {
    /// Azimuth, elevation and field of view, degrees.
    pub angles: Track<3>,
    /// Distance from the target, mm; none fits the mesh of all frames into the picture.
    pub distance: Option<Track<1>>,
    /// The point at the middle of the picture, mm; none for the middle of the mesh.
    pub target: Option<Track<3>>,
}

impl Default for Animation {
    fn default() -> Self {
        Animation {
            clip: None,
            fps: defaults::FPS,
            duration: None,
            deformers: Vec::new(),
            light_turns: 0.0,
            light_keys: None,
            camera_turns: 0.0,
            camera_keys: None,
        }
    }
}

/// What moves, loaded and measured.
#[derive(Clone, Debug, PartialEq)]
pub struct Motion {
    /// The mesh, and what moves it. Shared: a viewer makes a motion for every step of a drag.
    pub model: Arc<Model>,
    /// mm per mesh unit.
    pub unit: f64,
    /// Frames of the loop, at least 1.
    pub frames: u32,
    /// How long it takes, s.
    pub duration: f64,
    /// The middle of what all frames fill, mm: positions on the device are relative to it.
    pub center: DVec3,
    /// Radius around it that holds every vertex of every frame, mm.
    pub radius: f64,
    /// Whether the camera is outside that sphere in every frame, with a margin.
    pub seen_from_outside: bool,
    clip: Option<Clip>,
    animation: Animation,
    // The mesh at time 0 before any deformer: these act on its box.
    rest: [DVec3; 2],
    light: Light,
    viewpoint: Viewpoint,
    fov: f64,
    // What of the viewpoint depends on all frames.
    target: DVec3,
    distance: f64,
    // The largest half extents in light space over all frames, mm.
    reach: DVec3,
}

/// One instant: all that one frame of an animation has and another has not.
#[derive(Clone, Debug, PartialEq)]
pub struct Moment {
    /// How the mesh stands.
    pub pose: Pose,
    /// The light.
    pub light: Light,
    /// The camera.
    pub camera: Camera,
    /// The frame of the light map, relative to [`Motion::center`].
    pub light_frame: LightFrame,
}

/// What a scene says of light and camera, before anything moves them.
pub(super) struct Still<'a> {
    pub name: &'a str,
    pub unit: f64,
    pub light: &'a Light,
    pub viewpoint: &'a Viewpoint,
    pub fov: f64,
    pub size: [u32; 2],
}

impl Animation {
    /// Whether anything moves of a scene with `model`.
    pub(super) fn moves(&self, model: &Model) -> bool {
        model.rig.is_some()
            || model.shapes.len() > 1
            || !self.deformers.is_empty()
            || self.light_turns != 0.0
            || self.light_keys.is_some()
            || self.camera_turns != 0.0
            || self.camera_keys.is_some()
    }

    /// How long it is where nobody says: as long as the clip, else the sequence, else the longest beat, else the last
    /// keyframe.
    fn natural_duration(&self, model: &Model, clip: Option<&Clip>) -> f64 {
        if let Some(clip) = clip {
            return clip.duration;
        }
        if model.shapes.len() > 1 {
            return model.shapes.len() as f64 / self.fps;
        }
        let beats = self.deformers.iter().map(|d| d.period);
        let light = self.light_keys.iter().filter_map(|keys| keys.times.last());
        let camera = self
            .camera_keys
            .iter()
            .filter_map(|keys| keys.angles.times.last());
        let longest = |times: &mut dyn Iterator<Item = f64>| {
            times.reduce(f64::max).filter(|&longest| longest > 0.0)
        };
        longest(&mut beats.into_iter())
            .or_else(|| longest(&mut light.chain(camera).copied()))
            .unwrap_or(defaults::DURATION)
    }
}

impl Motion {
    /// Loads nothing more: works out the loop of `animation` and what all its frames fill. `time` (s) is one more instant
    /// that is to be drawn.
    ///
    /// # Errors
    /// The clip does not exist, the loop is too long, a frame is not finite or too large, or the camera has no direction.
    pub(super) fn new(
        model: Arc<Model>,
        animation: &Animation,
        still: &Still,
        time: f64,
    ) -> Result<Motion, Error> {
        let fault = |problem: String| Error::of(still.name, problem);
        let clip = model.clip(animation.clip.as_deref(), still.name)?.cloned();
        let duration = animation
            .duration
            .unwrap_or_else(|| animation.natural_duration(&model, clip.as_ref()));
        let frames = (duration * animation.fps).round().max(1.0);
        if frames > f64::from(defaults::FRAMES_MAX) {
            return Err(fault(format!(
                "{duration} s at {} frames a second are {frames} frames, more than {}; shorten the duration, or lower fps",
                animation.fps,
                defaults::FRAMES_MAX
            )));
        }
        let mut motion = Motion {
            unit: still.unit,
            frames: frames as u32,
            duration,
            center: DVec3::ZERO,
            radius: 0.0,
            seen_from_outside: false,
            clip,
            animation: animation.clone(),
            rest: [DVec3::ZERO; 2],
            light: still.light.clone(),
            viewpoint: still.viewpoint.clone(),
            fov: still.fov,
            target: DVec3::ZERO,
            distance: 1.0,
            reach: DVec3::ZERO,
            model,
        };
        let asked = animation.fps;
        if (motion.fps() - asked).abs() > 1e-6 * asked {
            tracing::warn!(
                "{}: a loop of {duration} s is {} frames at {:.3} a second, since {asked} a second would be {:.2}; set \
                 another fps or duration for a whole number",
                still.name,
                motion.frames,
                motion.fps(),
                duration * asked,
            );
        }
        let rest = motion.model.positions(&motion.unbent(0.0));
        motion.rest =
            corners(&rest).ok_or_else(|| fault("no vertex; name another mesh".to_owned()))?;
        // A ripple far finer than the mesh is noise, and in float32 not even that.
        let extent = motion.rest[0].distance(motion.rest[1]);
        let waves = animation.deformers.iter().filter_map(|d| d.wavelength);
        if let Some(short) = waves.into_iter().find(|length| *length < 1e-3 * extent) {
            return Err(fault(format!(
                "a deformer has a wavelength of {short:e} mm, less than a thousandth of the mesh; lengthen it"
            )));
        }
        motion.measure(still, motion.within(time))?;
        Ok(motion)
    }

    /// The same motion under another light and seen from elsewhere, not measured anew: the light map has the scale of the
    /// sphere around all frames, which serves every direction, and the camera what it kept. For frames drawn while a light
    /// or a camera is dragged; keyframes of either go.
    #[must_use]
    pub fn steered(&self, light: &Light, viewpoint: &Viewpoint, fov: f64) -> Motion {
        let mut motion = Motion {
            light: light.clone(),
            viewpoint: viewpoint.clone(),
            fov,
            reach: DVec3::splat(self.radius),
            ..self.clone()
        };
        motion.animation.light_keys = None;
        motion.animation.camera_keys = None;
        let eye = motion.camera(0.0).eye;
        motion.seen_from_outside = eye.distance(self.center) > super::mesh::OUTSIDE * self.radius;
        motion
    }

    /// What all frames fill, and from where the camera sees it.
    fn measure(&mut self, still: &Still, time: f64) -> Result<(), Error> {
        let fault = |problem: String| Error::of(still.name, problem);
        let mut times: Vec<f64> = (0..self.frames).map(|n| self.time(n)).collect();
        times.push(time);
        // One mesh may do for all; else each is posed twice, since a long loop would fill the memory.
        let still_mesh = (!self.deforms()).then(|| Arc::new(self.positions(0.0)));
        let mesh = |motion: &Motion, t: f64| {
            let moved = || Arc::new(motion.positions(t));
            still_mesh.clone().unwrap_or_else(moved)
        };

        let boxes = times.par_iter();
        let boxes = boxes.filter_map(|&t| corners(&mesh(self, t)));
        let join = |[a, b]: [DVec3; 2], [c, d]: [DVec3; 2]| [a.min(c), b.max(d)];
        let Some([lo, hi]) = boxes.reduce_with(join) else {
            return Err(fault("no vertex; name another mesh".to_owned()));
        };
        self.center = 0.5 * (lo + hi);

        // Turning cameras share a target and a distance, lest the picture breathe.
        let first = self.turned(times[0]);
        let turns = times.iter().any(|&t| self.turned(t) != first);
        let around = turns || self.deforms();
        let filled = times.par_iter().map(|&t| {
            let mesh = mesh(self, t);
            let squares = mesh.iter().map(|p| p.distance_squared(self.center));
            let to_light = self.light(t).to_light();
            let [_, reach] = LightFrame::extents(mesh.iter().copied(), to_light);
            let Turned { viewpoint, fov } = self.turned(t);
            let viewpoint = if around {
                viewpoint.around(self.center)
            } else {
                viewpoint
            };
            let camera = viewpoint.camera(fov, still.size, &mesh)?;
            Ok((squares.fold(0.0, f64::max), reach, camera))
        });
        let filled: Vec<(f64, DVec3, Camera)> = filled
            .collect::<Result<_, _>>()
            .map_err(|phrase: String| fault(format!("camera: {phrase}")))?;
        let furthest = filled.iter().map(|f| f.0).fold(0.0, f64::max);
        self.radius = furthest.sqrt();
        // Squares of lengths must neither overflow nor vanish in the f32 of the shaders.
        if !(1e-9..=1e9).contains(&self.radius) || !self.center.is_finite() {
            return Err(fault(format!(
                "the mesh has a radius of {:e} mm in some frame, outside 1e-9 to 1e9; set unit (mm per mesh unit), or \
                 lower the amplitude of what moves it",
                self.radius
            )));
        }
        self.reach = filled.iter().map(|f| f.1).fold(DVec3::ZERO, DVec3::max);
        self.target = filled[0].2.target;
        let distances = filled.iter().map(|f| f.2.eye.distance(f.2.target));
        self.distance = distances.fold(0.0, f64::max);
        let eyes = times.iter().map(|&t| self.camera(t).eye);
        let nearest = eyes.map(|eye| eye.distance(self.center));
        self.seen_from_outside =
            nearest.fold(f64::INFINITY, f64::min) > super::mesh::OUTSIDE * self.radius;
        Ok(())
    }

    /// Whether the mesh itself moves.
    pub fn deforms(&self) -> bool {
        self.clip.is_some() || self.model.shapes.len() > 1 || !self.animation.deformers.is_empty()
    }

    /// The instant of the loop that `time` (s) is, in [0, duration).
    pub fn within(&self, time: f64) -> f64 {
        time.rem_euclid(self.duration)
    }

    /// The instant of frame `number`, s, in [0, duration).
    pub fn time(&self, number: u32) -> f64 {
        self.duration * f64::from(number % self.frames) / f64::from(self.frames)
    }

    /// Frames a second.
    pub fn fps(&self) -> f64 {
        f64::from(self.frames) / self.duration
    }

    fn unbent(&self, time: f64) -> Pose {
        let shapes = self.model.shapes.len();
        // Rounding must not hold a shape back.
        let shape = (time * self.fps() + 1e-6) as usize % shapes.max(1);
        let clip = self.clip.as_ref();
        let within = clip.map_or(0.0, |clip| time % clip.duration);
        self.model.pose(self.unit, shape, clip, within)
    }

    /// How the mesh stands at `time` (s).
    pub fn pose(&self, time: f64) -> Pose {
        let bends = self.animation.deformers.iter();
        Pose {
            bends: bends.map(|d| d.at(time, self.rest)).collect(),
            ..self.unbent(time)
        }
    }

    /// Where the vertices are at `time` (s), mm.
    fn positions(&self, time: f64) -> Vec<DVec3> {
        self.model.positions(&self.pose(time))
    }

    /// The mesh at `time` (s), mm.
    pub fn mesh(&self, time: f64) -> Mesh {
        self.model.posed(&self.pose(time))
    }

    /// How far through its loop `time` (s) is, in [0, 1).
    fn share(&self, time: f64) -> f64 {
        (time / self.duration).rem_euclid(1.0)
    }

    /// The light at `time` (s).
    pub fn light(&self, time: f64) -> Light {
        let mut light = self.light.clone();
        if let Some(keys) = &self.animation.light_keys {
            let [azimuth, elevation, irradiance, r, g, b] = keys.at(time);
            light = Light {
                azimuth,
                // A spline may go beyond its keyframes.
                elevation: elevation.clamp(-90.0, 90.0),
                irradiance: irradiance.max(0.0),
                color: DVec3::new(r, g, b).max(DVec3::ZERO),
            };
        }
        light.azimuth += self.light_turned(time);
        light
    }

    /// By how many degrees its turns have turned the light at `time` (s).
    pub fn light_turned(&self, time: f64) -> f64 {
        360.0 * self.animation.light_turns * self.share(time)
    }

    /// Where the camera stands at `time` (s), before it is fitted.
    fn turned(&self, time: f64) -> Turned {
        let mut turned = Turned {
            viewpoint: self.viewpoint.clone(),
            fov: self.fov,
        };
        if let Some(keys) = &self.animation.camera_keys {
            let [azimuth, elevation, fov] = keys.angles.at(time);
            turned = Turned {
                viewpoint: Viewpoint::Orbit {
                    azimuth,
                    elevation: elevation.clamp(-90.0, 90.0),
                    distance: keys
                        .distance
                        .as_ref()
                        .map(|track| track.at(time)[0].max(1e-6)),
                    target: keys.target.as_ref().map(|track| track.at(time).into()),
                },
                fov: fov.clamp(0.1, 170.0),
            };
        }
        turned.viewpoint = turned
            .viewpoint
            .turned(360.0 * self.animation.camera_turns * self.share(time));
        turned
    }

    /// The camera at `time` (s).
    pub fn camera(&self, time: f64) -> Camera {
        let Turned { viewpoint, fov } = self.turned(time);
        viewpoint.placed(fov, self.target, self.distance)
    }

    /// The frame of a light map of `size` texels a side at `time` (s), around the mesh of that instant, whose vertices are
    /// `positions` (mm). Relative to [`Motion::center`].
    fn light_frame_of(&self, positions: &[DVec3], time: f64, size: u32) -> LightFrame {
        let relative = positions.iter().map(|&p| p - self.center);
        LightFrame::place(relative, self.light(time).to_light(), self.reach, size)
    }

    /// The frame of a light map of `size` texels a side at `time` (s), around the mesh of that instant, relative to
    /// [`Motion::center`].
    pub fn light_frame(&self, time: f64, size: u32) -> LightFrame {
        self.light_frame_of(&self.positions(time), time, size)
    }

    /// The instant `time` (s), on a light map of `size` texels a side.
    pub fn moment(self: &Arc<Self>, time: f64, size: u32) -> Moment {
        let pose = self.pose(time);
        let positions = self.model.positions(&pose);
        Moment {
            light: self.light(time),
            camera: self.camera(time),
            light_frame: self.light_frame_of(&positions, time, size),
            pose,
        }
    }
}

/// The box around `positions`, mm; none without any.
fn corners(positions: &[DVec3]) -> Option<[DVec3; 2]> {
    let (&first, rest) = positions.split_first()?;
    let join = |[lo, hi]: [DVec3; 2], p: &DVec3| [lo.min(*p), hi.max(*p)];
    Some(rest.iter().fold([first; 2], join))
}
