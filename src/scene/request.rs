//! What is asked for, before anything is loaded: the sum of defaults, scene file and flags.

use super::bundled::{self, Bundled};
use super::deformer::DEFORMERS_MAX;
use super::motion::Still;
use super::sequence::Pattern;
use super::{
    Animation, Error, Exits, Fourth, Jitter, Light, March, Material, Method, Mixture, Model,
    Motion, Multiple, Plan, Scattering, Scene, Single, Viewpoint, defaults, file, gltf, limits,
    names, obj,
};
use crate::optics::mixture::Fit;
use glam::DVec3;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Names what a value is of, where a limit refuses it.
type Check<'a> = dyn Fn(&str, Result<(), String>) -> Result<(), Error> + 'a;

/// Where a mesh comes from.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum MeshSource {
    /// One that ships inside the binary.
    Bundled(Bundled),
    /// An OBJ or glTF file, or a sequence of OBJ files ([`Pattern`]).
    File(PathBuf),
}

/// Everything that a picture depends on, not loaded and not yet validated as a whole.
///
/// [`Request::open`] fills it from a scene file; flags then overwrite fields; and
/// [`Request::plan`] loads the mesh, fits the camera and checks every value.
#[derive(Clone, Debug, PartialEq)]
pub struct Request {
    /// Where the request came from, for messages.
    pub name: String,
    /// The geometry.
    pub mesh: MeshSource,
    /// mm per mesh unit.
    pub unit: f64,
    /// The medium.
    pub material: Material,
    /// Whether a colour in the mesh file takes the place of `material`: where nobody has chosen one.
    pub colored_by_mesh: bool,
    /// What moves.
    pub animation: Animation,
    /// The instant of a still, s; none for the first.
    pub time: Option<f64>,
    /// The light.
    pub light: Light,
    /// Where the camera stands.
    pub viewpoint: Viewpoint,
    /// The camera's vertical field of view, degrees.
    pub fov: f64,
    /// Width and height, pixels.
    pub size: [u32; 2],
    /// Fetches a pixel that may be made, where they choose the methods of both kinds of scattering.
    /// [`Request::plan`] knows no fetches and heeds the methods below:
    /// [`choose`](crate::ledger::budget::choose) then takes others.
    pub fetch_budget: Option<u32>,
    /// Method for multiple scattering.
    pub multiple: Method,
    /// Method of the left part, if it differs.
    pub split: Option<Method>,
    /// The share of the picture's width that is left of the divider, in [0, 1], where it is split.
    pub split_at: f64,
    /// Samples a pixel, for the method that takes them.
    pub samples: u32,
    /// Rings, for the method that takes them.
    pub rings: u32,
    /// Moments of depth that the mixture reads: 3 or 4.
    pub moments: u32,
    /// The first level of the mixture that reads the fourth moment, if any does.
    pub fourth_from: u32,
    /// How many levels of the mixture read the fourth moment, those that carry the most light; none
    /// for all from `fourth_from` on.
    pub fourth_levels: Option<u32>,
    /// 1 where the mixture taps every level, 2 where every second.
    pub level_step: u32,
    /// How many levels of the mixture, the coarsest, read volumes of light.
    pub volumes: u32,
    /// Where the weights of the mixture come from.
    pub weights: Fit,
    /// How light that is scattered once is computed.
    pub single: Single,
    /// How the march of single scattering finds the lit surface.
    pub exits: Exits,
    /// At which size scattering is shaded.
    pub scattering: Scattering,
    /// Whether the specular reflection is added.
    pub specular: bool,
    /// Texels along a side of the light map.
    pub light_map: u32,
    /// Frames averaged; none for as many as fit the occasion.
    pub frames_averaged: Option<u32>,
    /// What moves between averaged frames.
    pub jitter: Jitter,
    /// Factor on radiance before display encoding.
    pub exposure: f64,
    /// Linear RGB behind the picture; none keeps it transparent.
    pub background: Option<[f64; 3]>,
}

impl MeshSource {
    /// Whether `path` is named as a mesh file.
    pub fn is_mesh(path: &Path) -> bool {
        matches!(extension(path).as_deref(), Some("obj" | "gltf" | "glb"))
    }

    /// Loads the mesh, in its own unit, and what moves it.
    ///
    /// # Errors
    /// As [`obj::load`] and [`gltf::load`].
    pub fn load(&self) -> Result<Model, Error> {
        let path = match self {
            MeshSource::Bundled(bundled) => return bundled.load(),
            MeshSource::File(path) => path,
        };
        match Pattern::of(path).map_err(|phrase| Error::of(path.display(), phrase))? {
            Some(sequence) => Ok(Model {
                shapes: sequence.load()?,
                ..Model::default()
            }),
            None if extension(path).as_deref() == Some("obj") => Ok(Model::of(obj::load(path)?)),
            None => gltf::load(path),
        }
    }
}

impl Request {
    /// The defaults, for the mesh of the given source.
    pub fn of_mesh(name: String, mesh: MeshSource) -> Request {
        let material = Material::preset(defaults::MATERIAL).unwrap_or_else(|_| Material {
            // Unreachable while the default is a preset, which a test holds.
            name: "custom".to_owned(),
            sigma_s: DVec3::ONE,
            sigma_a: DVec3::ZERO,
            eta: defaults::ETA,
            g: defaults::G,
            roughness: defaults::ROUGHNESS,
        });
        Request {
            name,
            mesh,
            unit: defaults::UNIT,
            material,
            colored_by_mesh: true,
            animation: Animation::default(),
            time: None,
            light: Light {
                azimuth: defaults::LIGHT_AZIMUTH,
                elevation: defaults::LIGHT_ELEVATION,
                irradiance: defaults::LIGHT_IRRADIANCE,
                color: DVec3::ONE,
            },
            viewpoint: Viewpoint::default(),
            fov: defaults::CAMERA_FOV,
            size: defaults::SIZE,
            fetch_budget: None,
            multiple: Method::Samples,
            split: None,
            split_at: defaults::SPLIT_AT,
            samples: defaults::SAMPLES,
            rings: defaults::RINGS,
            moments: defaults::MOMENTS,
            fourth_from: 0,
            fourth_levels: None,
            level_step: 1,
            volumes: 0,
            weights: Fit::Best,
            single: Single::March(March {
                steps: defaults::SINGLE,
                exits: Exits::Linear,
            }),
            exits: Exits::Linear,
            scattering: Scattering::Full,
            specular: true,
            light_map: defaults::LIGHT_MAP,
            frames_averaged: None,
            jitter: Jitter::All,
            exposure: defaults::EXPOSURE,
            background: None,
        }
    }

    /// The bundled statue with every default.
    pub fn statue() -> Request {
        Request::of_mesh("statue".to_owned(), MeshSource::Bundled(Bundled::Statue20k))
    }

    /// Opens a scene: a `.toml` file, a bare `.obj`, `.gltf` or `.glb`, or the name of a bundled mesh.
    ///
    /// # Errors
    /// The source is none of these, or the scene file is at fault. A mesh is not
    /// opened before [`Request::plan`].
    pub fn open(source: &Path) -> Result<Request, Error> {
        if let Some(bundled) = source.to_str().and_then(Bundled::named) {
            return Ok(Request::of_mesh(
                bundled.name().to_owned(),
                MeshSource::Bundled(bundled),
            ));
        }
        match extension(source).as_deref() {
            Some("toml") => file::load(source),
            _ if MeshSource::is_mesh(source) => Ok(Request::of_mesh(
                source.display().to_string(),
                MeshSource::File(source.to_owned()),
            )),
            _ => Err(Error::of(
                source.display(),
                format!(
                    "no scene: neither a .toml, .obj, .gltf or .glb file nor a bundled mesh; {}",
                    names::remedy(&source.to_string_lossy(), &bundled::NAMES)
                ),
            )),
        }
    }

    /// Shows what `other` shows in place of its own: mesh, size, what moves, and where the camera stands. Light, material and
    /// method stay.
    pub fn show(&mut self, other: &Request) {
        let shown = other.clone();
        self.name = shown.name;
        self.mesh = shown.mesh;
        self.unit = shown.unit;
        self.animation = shown.animation;
        self.time = None;
        self.viewpoint = shown.viewpoint;
    }

    /// Loads the mesh, fits the camera and checks every value.
    ///
    /// # Errors
    /// The mesh cannot be used, or a value lies outside its [`limits`].
    pub fn plan(&self) -> Result<Plan, Error> {
        self.plan_of(&Arc::new(self.mesh.load()?))
    }

    /// Checks every value that no mesh is needed for.
    fn check(&self) -> Result<(), Error> {
        let check = |what: &str, result: Result<(), String>| {
            result.map_err(|phrase| Error::of(&self.name, format!("{what} {phrase}")))
        };
        check("unit", limits::positive(self.unit).map(drop))?;
        check("material:", self.material.check())?;
        let light = &self.light;
        check("light azimuth", limits::finite(light.azimuth).map(drop))?;
        check(
            "light elevation",
            limits::elevation(light.elevation).map(drop),
        )?;
        check(
            "light irradiance",
            limits::non_negative(light.irradiance).map(drop),
        )?;
        check("light color", limits::color(light.color).map(drop))?;
        check("camera fov", limits::fov(self.fov).map(drop))?;
        check("size", limits::size(self.size.map(i64::from)).map(drop))?;
        if let Some(budget) = self.fetch_budget {
            check("fetch_budget", limits::budget(budget.into()).map(drop))?;
        }
        check("split_at", limits::share(self.split_at).map(drop))?;
        check("samples", limits::samples(self.samples.into()).map(drop))?;
        check("rings", limits::rings(self.rings.into()).map(drop))?;
        check("moments", limits::moments(self.moments.into()).map(drop))?;
        check(
            "fourth_from",
            limits::level(self.fourth_from.into()).map(drop),
        )?;
        if let Some(count) = self.fourth_levels {
            check(
                "fourth_levels",
                limits::fourth_levels(count.into()).map(drop),
            )?;
        }
        check(
            "level_step",
            limits::level_step(self.level_step.into()).map(drop),
        )?;
        if let Single::March(march) = self.single {
            check("single", limits::steps(march.steps.into()).map(drop))?;
        }
        check("volumes", limits::volumes(self.volumes.into()).map(drop))?;
        check(
            "light_map",
            limits::light_map(self.light_map.into()).map(drop),
        )?;
        if let Some(frames) = self.frames_averaged {
            check(
                "frames_averaged",
                limits::frames_averaged(frames.into()).map(drop),
            )?;
        }
        check("exposure", limits::positive(self.exposure).map(drop))?;
        if let Some(background) = self.background {
            check("background", limits::color(background.into()).map(drop))?;
        }

        if self.scattering == Scattering::Half {
            check("scattering half", self.check_half())?;
        }

        self.check_animation(&check)
    }

    /// [`Request::plan`] for `model` in place of the mesh of the request.
    ///
    /// # Errors
    /// As [`Request::plan`].
    pub fn plan_of(&self, model: &Arc<Model>) -> Result<Plan, Error> {
        self.check()?;
        let motion = self.motion(model)?;
        self.plan_with(model, motion)
    }

    /// As [`Request::plan_of`], but what moves is that of `motion`, a motion of the same model and animation, steered to light
    /// and camera of this request ([`Motion::steered`]): quick enough for every step of a drag.
    ///
    /// # Errors
    /// As [`Request::plan`].
    pub fn plan_steered(&self, motion: &Motion) -> Result<Plan, Error> {
        self.check()?;
        let steered = motion.steered(&self.light, &self.viewpoint, self.fov);
        self.plan_with(&motion.model, Some(steered))
    }

    fn plan_with(&self, model: &Arc<Model>, motion: Option<Motion>) -> Result<Plan, Error> {
        let material = match model.base_color {
            Some(color) if self.colored_by_mesh => Material::colored(color, &self.material),
            _ => self.material.clone(),
        };
        let mut time = 0.0;
        let scene = match &motion {
            Some(motion) => {
                time = motion.within(self.time.unwrap_or(0.0));
                Scene {
                    name: self.name.clone(),
                    mesh: motion.mesh(time),
                    material,
                    light: motion.light(time),
                    camera: motion.camera(time),
                }
            }
            None => self.still(model, material)?,
        };
        Ok(Plan {
            scene,
            motion: motion.map(Arc::new),
            time,
            size: self.size,
            part: None,
            multiple: self.with_parameters(self.multiple),
            split: self.split.map(|method| self.with_parameters(method)),
            split_at: self.split_at,
            single: match self.single {
                Single::March(march) => Single::March(March {
                    exits: self.exits,
                    ..march
                }),
                other => other,
            },
            scattering: self.scattering,
            specular: self.specular,
            light_map: self.light_map,
            frames_averaged: self.frames_averaged.unwrap_or(defaults::FRAMES_AVERAGED),
            jitter: self.jitter,
            exposure: self.exposure,
            background: self.background,
        })
    }
}

impl Request {
    /// What moves, if anything does.
    fn motion(&self, model: &Arc<Model>) -> Result<Option<Motion>, Error> {
        if !self.animation.moves(model) {
            model.clip(self.animation.clip.as_deref(), &self.name)?;
            if self.time.is_some_and(|time| time != 0.0) {
                return Err(Error::of(
                    &self.name,
                    "a time is given, but nothing moves; drop it, or animate something (docs/scene.md)",
                ));
            }
            return Ok(None);
        }
        let still = Still {
            name: &self.name,
            unit: self.unit,
            light: &self.light,
            viewpoint: &self.viewpoint,
            fov: self.fov,
            size: self.size,
        };
        let time = self.time.unwrap_or(0.0);
        Motion::new(Arc::clone(model), &self.animation, &still, time).map(Some)
    }

    /// The scene of a mesh that rests under a light and before a camera that do.
    fn still(&self, model: &Model, material: Material) -> Result<Scene, Error> {
        let mesh = model.shapes.last().cloned().unwrap_or_default();
        let mesh = mesh.scaled(self.unit);
        let radius = mesh.bounding_radius();
        // Squares of lengths must neither overflow nor vanish in the f32 of the shaders.
        if !(1e-9..=1e9).contains(&radius) {
            return Err(Error::of(
                &self.name,
                format!(
                    "the mesh has a radius of {radius:e} mm, outside 1e-9 to 1e9; \
                     set unit (mm per mesh unit)"
                ),
            ));
        }
        let camera = self
            .viewpoint
            .camera(self.fov, self.size, &mesh.positions)
            .map_err(|phrase| Error::of(&self.name, format!("camera: {phrase}")))?;
        Ok(Scene {
            name: self.name.clone(),
            mesh,
            material,
            light: self.light.clone(),
            camera,
        })
    }

    /// Checks what moves, as [`Request::plan`] checks the rest.
    fn check_animation(&self, check: &Check<'_>) -> Result<(), Error> {
        let animation = &self.animation;
        check("fps", limits::fps(animation.fps).map(drop))?;
        if let Some(duration) = animation.duration {
            check("duration", limits::duration(duration).map(drop))?;
        }
        if let Some(time) = self.time {
            check("time", limits::time(time).map(drop))?;
        }
        check(
            "light turns",
            limits::finite(animation.light_turns).map(drop),
        )?;
        check(
            "camera turns",
            limits::finite(animation.camera_turns).map(drop),
        )?;
        let count = animation.deformers.len();
        if count > DEFORMERS_MAX {
            let phrase = format!("must be at most {DEFORMERS_MAX}, not {count}");
            check("deformers", Err(phrase))?;
        }
        for deformer in &animation.deformers {
            check("deformer", deformer.check())?;
        }
        Ok(())
    }

    /// Whether the surface is opaque: no light is scattered beneath it, neither once nor more often.
    pub fn is_opaque(&self) -> bool {
        self.multiple == Method::Brdf
    }

    /// What goes with scattering at half size, as a phrase that reads on from its name.
    fn check_half(&self) -> Result<(), String> {
        let another = "choose --scattering full, or --multiple none, samples, rings or mixture";
        match self.multiple {
            Method::Brdf => Err(format!(
                "has no effect on the method brdf, which knows no transport; {another}"
            )),
            Method::Exact => Err(format!(
                "is not for the method exact, the reference; {another}"
            )),
            _ if self.fetch_budget.is_some() => Err(
                "is no choice that a fetch budget makes; choose --scattering full, or leave --fetch-budget out"
                    .to_owned(),
            ),
            _ if self.split.is_some() => Err(
                "shades no picture that is split; choose --scattering full, or leave --split out"
                    .to_owned(),
            ),
            _ if self.single == Single::Traced => Err(
                "is not for single scattering that is traced, the reference; choose --scattering full, or --single 8"
                    .to_owned(),
            ),
            Method::None if self.single == Single::Off => Err(
                "has nothing to shade; choose --scattering full, or --single 8".to_owned(),
            ),
            _ => Ok(()),
        }
    }

    fn with_parameters(&self, method: Method) -> Multiple {
        let mixture = Mixture {
            fourth: match (self.moments, self.fourth_levels) {
                (4, Some(count)) => Fourth::Most(count),
                (4, None) => Fourth::From(self.fourth_from),
                _ => Fourth::Never,
            },
            level_step: self.level_step,
            fit: self.weights,
            volumes: self.volumes,
        };
        method.with(self.samples, self.rings, mixture)
    }
}

/// The extension in lower case.
fn extension(path: &Path) -> Option<String> {
    Some(path.extension()?.to_str()?.to_lowercase())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_default_material_is_a_preset() {
        assert_eq!(
            Request::statue().material.name,
            defaults::MATERIAL,
            "the fallback in of_mesh must stay unreachable"
        );
    }

    #[test]
    fn the_divider_is_the_nearest_column() {
        let mut plan = Request::statue().plan().expect("a plan");
        plan.split = Some(Multiple::Brdf);
        let mut at = |width, share| {
            (plan.size[0], plan.split_at) = (width, share);
            let columns: Vec<_> = plan.parts().map(|(columns, _)| columns).collect();
            (plan.divider(), columns)
        };
        for width in 1..3000 {
            // Pictures with a default stay what they were.
            assert_eq!(at(width, defaults::SPLIT_AT).0, width / 2);
            assert_eq!(at(width, 0.0), (0, vec![[0, width]]));
            assert_eq!(at(width, 1.0), (width, vec![[0, width]]));
        }
        assert_eq!(at(100, 0.25), (25, vec![[0, 25], [25, 100]]));
        assert_eq!(at(100, 0.254).0, 25);
        assert_eq!(at(100, 0.256).0, 26);
        assert_eq!(at(16384, 1.0 - 1e-9), (16384, vec![[0, 16384]]));
        (plan.split_at, plan.split) = (1.0, Some(plan.multiple));
        assert_eq!(plan.methods().count(), 1);
        // A part without columns has no method to be drawn or accounted for.
        plan.split = Some(Multiple::Exact);
        assert_eq!(plan.methods().collect::<Vec<_>>(), [Multiple::Exact]);
        plan.split_at = 0.0;
        assert_eq!(plan.methods().collect::<Vec<_>>(), [plan.multiple]);
    }

    #[test]
    fn the_defaults_are_a_valid_plan() {
        let plan = Request::statue().plan().expect("a plan");
        assert_eq!(plan.size, [800, 600]);
        assert_eq!(plan.multiple, crate::scene::Multiple::Samples(30));
    }
}
