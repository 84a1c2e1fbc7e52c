//! Scenes written as files: what [`super::file`] reads back, in the order of docs/scene.md.

use super::color::srgb_to_linear;
use super::keys::Track;
use super::motion::CameraKeys;
use super::{Deformer, Error, Material, MeshSource, Request, Single, Viewpoint, defaults, preset};
use std::path::absolute;

/// Where comments behind values begin, columns, as in assets/scenes/statue.toml.
const COMMENTS: usize = 25;

/// Nothing, or the phrase of what cannot be written.
type Written = Result<(), String>;

impl Request {
    /// The request as a scene file, which [`super::file::parse`] reads back as the same request, every number to its last
    /// bit. All settings are written, so that the file keeps its meaning where a default changes, but for what is left to
    /// the mesh or to the occasion. A mesh is named by its absolute path, so that the file may lie anywhere.
    ///
    /// What no picture depends on is left out: the methods, where a fetch budget chooses others; direction and wavelength
    /// of a deformer that has none; distance and target of a camera whose keyframes fit the object; and the name of a material that
    /// is no preset, which reads back as "custom".
    ///
    /// # Errors
    /// The path of the mesh is not UTF-8, a number is not finite, or there are keyframes that a file cannot say: none at
    /// all, those of a camera at a position, or times of its distance or target that are not those of its angles.
    pub fn to_toml(&self) -> Result<String, Error> {
        let mut writer = Writer::default();
        self.write(&mut writer)
            .map_err(|problem| Error::of(&self.name, problem))?;
        Ok(writer.text)
    }

    fn write(&self, to: &mut Writer) -> Written {
        to.remark("A scene of marmor. Every key is described in its docs/scene.md.");
        to.value("name", text(&self.name), "for messages");
        to.value("mesh", mesh(&self.mesh)?, "");
        to.value("unit", number(self.unit)?, "mm per mesh unit");
        let preset = Material::preset(&self.material.name).as_ref() == Ok(&self.material);
        let chosen = !self.colored_by_mesh;
        let unchosen = preset && !chosen && self.material.name == defaults::MATERIAL;
        if preset && chosen {
            to.value("material", text(&self.material.name), "a preset");
        } else if unchosen {
            let name = defaults::MATERIAL;
            to.remark(&format!(
                "no material: that of the mesh's colour, or else {name}"
            ));
        }
        let [width, height] = self.size;
        to.value("size", format!("[{width}, {height}]"), "pixels");
        let what = "factor on radiance before it is encoded for display";
        to.value("exposure", number(self.exposure)?, what);
        to.value("background", background(self.background)?, "");
        if !(preset && chosen || unchosen) {
            self.write_material(to)?;
        }
        to.table("light");
        let light = &self.light;
        to.value("azimuth", number(light.azimuth)?, "degrees");
        to.value("elevation", number(light.elevation)?, "degrees");
        let what = "on a surface that faces the light";
        to.value("irradiance", number(light.irradiance)?, what);
        to.value("color", vector(light.color.to_array())?, "linear RGB");
        self.write_camera(to)?;
        self.write_method(to)?;
        self.write_animation(to)
    }

    fn write_material(&self, to: &mut Writer) -> Written {
        let material = &self.material;
        to.table("material");
        let known = Material::preset(&material.name).is_ok_and(|preset| {
            let roughness = material.roughness;
            *material
                == Material {
                    roughness,
                    ..preset
                }
        });
        if known {
            to.value("preset", text(&material.name), "");
        } else {
            // Coefficients of a preset have a name, whatever else was changed.
            let of = preset::NAMES.into_iter().find(|name| {
                Material::preset(name).is_ok_and(|preset| {
                    (preset.sigma_s, preset.sigma_a) == (material.sigma_s, material.sigma_a)
                })
            });
            let of = of.map_or(String::new(), |name| format!(": those of {name}"));
            let what = "reduced scattering, mm^-1";
            to.value("sigma_s", vector(material.sigma_s.to_array())?, what);
            let what = format!("absorption, mm^-1{of}");
            to.value("sigma_a", vector(material.sigma_a.to_array())?, &what);
            let what = "relative index of refraction";
            to.value("eta", number(material.eta)?, what);
            let what = "mean cosine of light scattered once";
            to.value("g", number(material.g)?, what);
        }
        to.value("roughness", number(material.roughness)?, "GGX alpha");
        if self.colored_by_mesh {
            let what = "a colour in the mesh file takes the place of the coefficients";
            to.value("colored_by_mesh", "true".to_owned(), what);
        }
        Ok(())
    }

    fn write_camera(&self, to: &mut Writer) -> Written {
        to.table("camera");
        match self.viewpoint {
            Viewpoint::Orbit {
                azimuth,
                elevation,
                distance,
                target,
            } => {
                to.value("azimuth", number(azimuth)?, "degrees");
                to.value("elevation", number(elevation)?, "degrees");
                // Keyframes without one would take it up.
                let keys = self.animation.camera_keys.as_ref();
                let distance = distance.filter(|_| keys.is_none_or(|keys| keys.distance.is_some()));
                let target = target.filter(|_| keys.is_none_or(|keys| keys.target.is_some()));
                match distance {
                    Some(distance) => {
                        to.value("distance", number(distance)?, "mm from the target");
                    }
                    None => to.remark("no distance: the object fills the picture"),
                }
                match target {
                    Some(target) => to.value("target", vector(target.to_array())?, "mm"),
                    None => to.remark("no target: the object is in the middle"),
                }
            }
            Viewpoint::At { eye, target, up } => {
                to.value("eye", vector(eye.to_array())?, "mm");
                to.value("target", vector(target.to_array())?, "mm");
                to.value("up", vector(up.to_array())?, "up in the picture");
            }
        }
        let what = "vertical field of view, degrees";
        to.value("fov", number(self.fov)?, what);
        Ok(())
    }

    fn write_method(&self, to: &mut Writer) -> Written {
        to.table("method");
        match self.fetch_budget {
            Some(budget) => {
                let what = "fetches a pixel, which choose the methods of scattering";
                to.value("fetch_budget", budget.to_string(), what);
            }
            None => self.write_scattering(to)?,
        }
        let what = "size at which scattering is shaded: full or half";
        to.value("scattering", text(self.scattering.name()), what);
        if self.fetch_budget.is_none() {
            self.write_split(to)?;
        }
        let what = "reflection at the surface";
        to.value("specular", self.specular.to_string(), what);
        let what = "texels along a side";
        to.value("light_map", self.light_map.to_string(), what);
        match self.frames_averaged {
            Some(frames) => to.value("frames_averaged", frames.to_string(), ""),
            None => to.remark("no frames_averaged: as many as fit the occasion"),
        }
        let what = "what moves between averaged frames: all, samples or off";
        to.value("jitter", text(self.jitter.name()), what);
        Ok(())
    }

    /// What a fetch budget would choose.
    fn write_scattering(&self, to: &mut Writer) -> Written {
        let what = "multiple scattering: none, brdf, samples, rings, mixture or exact";
        to.value("multiple", text(self.multiple.name()), what);
        to.value("samples", self.samples.to_string(), "a pixel, for samples");
        to.value("rings", self.rings.to_string(), "for rings");
        let what = "of depth, for mixture";
        to.value("moments", self.moments.to_string(), what);
        let what = "with 4 moments: the first level that reads the fourth";
        to.value("fourth_from", self.fourth_from.to_string(), what);
        if let Some(levels) = self.fourth_levels {
            let what = "... or how many levels do, those that carry the most light";
            to.value("fourth_levels", levels.to_string(), what);
        }
        let what = "for mixture: 2 taps every second level";
        to.value("level_step", self.level_step.to_string(), what);
        let what = "levels of mixture, the coarsest, that read volumes";
        to.value("volumes", self.volumes.to_string(), what);
        let what = "of mixture: closed, fitted or best";
        to.value("weights", text(self.weights.name()), what);
        let single = match self.single {
            Single::Off => text("off"),
            Single::Traced => text("traced"),
            Single::March(march) => march.steps.to_string(),
        };
        let what = "samples of single scattering, \"off\", or \"traced\" by rays";
        to.value("single", single, what);
        let what = "how they find the lit surface: linear, nearest or depth";
        to.value("exits", text(self.exits.name()), what);
        Ok(())
    }

    fn write_split(&self, to: &mut Writer) -> Written {
        if let Some(split) = self.split {
            to.value("split", text(split.name()), "the method of the left part");
        }
        if self.split.is_some() || self.split_at != defaults::SPLIT_AT {
            let what = "the share of the width that split draws";
            to.value("split_at", number(self.split_at)?, what);
        }
        Ok(())
    }

    fn write_animation(&self, to: &mut Writer) -> Written {
        let animation = &self.animation;
        to.table("animation");
        if let Some(clip) = &animation.clip {
            to.value("clip", text(clip), "");
        }
        to.value("fps", number(animation.fps)?, "frames a second");
        match animation.duration {
            Some(duration) => to.value("duration", number(duration)?, "seconds of the loop"),
            None => to.remark("no duration: that of what moves"),
        }
        if let Some(time) = self.time {
            to.value("time", number(time)?, "the instant of a still, s");
        }
        let deformers = animation.deformers.iter().map(deformer);
        to.tables("deform", &deformers.collect::<Result<Vec<_>, _>>()?);
        let (turns, keys) = (animation.light_turns, &animation.light_keys);
        if turns != 0.0 || keys.is_some() {
            to.table("animation.light");
            to.value("turns", number(turns)?, "about the vertical, over the loop");
        }
        if let Some(track) = keys {
            to.keys(track, &light_keys(track)?);
        }
        let (turns, keys) = (animation.camera_turns, &animation.camera_keys);
        if turns != 0.0 || keys.is_some() {
            to.table("animation.camera");
            to.value("turns", number(turns)?, "about the vertical, over the loop");
        }
        if let Some(keys) = keys {
            if let Viewpoint::At { .. } = self.viewpoint {
                return Err(
                    "a camera at a position has keyframes, which are of an orbit; drop one of the two"
                        .to_owned(),
                );
            }
            to.keys(&keys.angles, &camera_keys(keys)?);
        }
        Ok(())
    }
}

/// The text of a scene file, as far as it is written.
#[derive(Default)]
struct Writer {
    text: String,
}

impl Writer {
    /// A comment on a line of its own.
    fn remark(&mut self, what: &str) {
        self.text += &format!("# {what}\n");
    }

    fn table(&mut self, title: &str) {
        self.text += &format!("\n[{title}]\n");
    }

    /// A key, its value in TOML, and what it is.
    fn value(&mut self, key: &str, value: String, what: &str) {
        let line = format!("{key} = {value}");
        self.text += &match what {
            "" => line,
            _ => format!("{line:<COMMENTS$} # {what}"),
        };
        self.text.push('\n');
    }

    /// An array of inline tables, one on each line; none without any.
    fn tables(&mut self, key: &str, tables: &[String]) {
        if tables.is_empty() {
            return;
        }
        self.text += &format!("{key} = [\n");
        for table in tables {
            self.text += &format!("  {{ {table} }},\n");
        }
        self.text += "]\n";
    }

    /// The keyframes of `track`, as tables.
    fn keys<const N: usize>(&mut self, track: &Track<N>, tables: &[String]) {
        self.value("interpolation", text(track.ease.name()), "");
        self.tables("keys", tables);
    }
}

/// A text in quotes, with what TOML wants escaped.
fn text(value: &str) -> String {
    toml::Value::from(value).to_string()
}

/// A number as short as it reads back to its last bit, and with an exponent where it has many zeros.
fn number(value: f64) -> Result<String, String> {
    match value.is_finite() {
        true => Ok(format!("{value:?}")),
        false => Err(format!(
            "a number is {value}, which no scene may hold; choose a finite one"
        )),
    }
}

fn vector(value: [f64; 3]) -> Result<String, String> {
    let [x, y, z] = value.map(number);
    Ok(format!("[{}, {}, {}]", x?, y?, z?))
}

/// The bundled mesh, or the absolute path of a file.
fn mesh(source: &MeshSource) -> Result<String, String> {
    let path = match source {
        MeshSource::Bundled(bundled) => return Ok(text(bundled.name())),
        MeshSource::File(path) => path,
    };
    let path = absolute(path).map_err(|error| {
        let path = path.display();
        format!("the mesh {path} has no absolute path ({error}); name it by one")
    })?;
    path.to_str().map(text).ok_or_else(|| {
        let path = path.display();
        format!("the path of the mesh {path} is not UTF-8, which a scene file is; rename it")
    })
}

/// As #rrggbb where that reads back as the same colour.
fn background(color: Option<[f64; 3]>) -> Result<String, String> {
    let Some(color) = color else {
        return Ok(text("none"));
    };
    let code = |channel: f64| {
        (0..=u8::MAX).find(|&byte| srgb_to_linear(f64::from(byte) / 255.0) == channel)
    };
    match color.map(code) {
        [Some(r), Some(g), Some(b)] => Ok(text(&format!("#{r:02x}{g:02x}{b:02x}"))),
        _ => vector(color),
    }
}

/// A deformer as an inline table.
fn deformer(deformer: &Deformer) -> Result<String, String> {
    let kind = deformer.kind;
    let mut table = format!(
        "kind = {}, axis = {}",
        text(kind.name()),
        vector(deformer.axis.to_array())?
    );
    if let Some(towards) = deformer.towards.filter(|_| kind.has_direction()) {
        table += &format!(", towards = {}", vector(towards.to_array())?);
    }
    table += &format!(
        ", amplitude = {}, period = {}, phase = {}",
        number(deformer.amplitude)?,
        number(deformer.period)?,
        number(deformer.phase)?
    );
    if let Some(length) = deformer.wavelength.filter(|_| kind.has_length()) {
        table += &format!(", wavelength = {}", number(length)?);
    }
    Ok(table)
}

/// The keyframes of a light as inline tables.
fn light_keys(track: &Track<6>) -> Result<Vec<String>, String> {
    check_keys("light", track, &track.times)?;
    let keys = track.times.iter().zip(&track.values);
    let keys = keys.map(|(&time, &[azimuth, elevation, irradiance, r, g, b])| {
        Ok(format!(
            "time = {}, azimuth = {}, elevation = {}, irradiance = {}, color = {}",
            number(time)?,
            number(azimuth)?,
            number(elevation)?,
            number(irradiance)?,
            vector([r, g, b])?
        ))
    });
    keys.collect()
}

/// The keyframes of a camera as inline tables.
fn camera_keys(keys: &CameraKeys) -> Result<Vec<String>, String> {
    let angles = &keys.angles;
    check_keys("camera", angles, &angles.times)?;
    let mut tables = Vec::new();
    for (&time, &[azimuth, elevation, _]) in angles.times.iter().zip(&angles.values) {
        tables.push(format!(
            "time = {}, azimuth = {}, elevation = {}",
            number(time)?,
            number(azimuth)?,
            number(elevation)?
        ));
    }
    if let Some(track) = &keys.distance {
        same_keys(track, angles)?;
        for (table, &[distance]) in tables.iter_mut().zip(&track.values) {
            *table += &format!(", distance = {}", number(distance)?);
        }
    }
    if let Some(track) = &keys.target {
        same_keys(track, angles)?;
        for (table, &target) in tables.iter_mut().zip(&track.values) {
            *table += &format!(", target = {}", vector(target)?);
        }
    }
    for (table, &[.., fov]) in tables.iter_mut().zip(&angles.values) {
        *table += &format!(", fov = {}", number(fov)?);
    }
    Ok(tables)
}

/// A file has a table for each keyframe, and each is whole.
fn check_keys<const N: usize>(of: &str, track: &Track<N>, times: &[f64]) -> Written {
    if track.times != times || track.values.len() != times.len() {
        return Err(format!(
            "the keyframes of the {of} have values at other times than each other; give them the same times"
        ));
    }
    match times {
        [] => Err(format!(
            "the {of} has keyframes, but none in them; give it one, or drop them"
        )),
        _ => Ok(()),
    }
}

/// Distance and target of a camera stand in the tables of its angles.
fn same_keys<const N: usize>(track: &Track<N>, angles: &Track<3>) -> Written {
    check_keys("camera", track, &angles.times)?;
    match track.ease == angles.ease {
        true => Ok(()),
        false => Err(
            "the keyframes of the camera have two interpolations; give them the same".to_owned(),
        ),
    }
}
