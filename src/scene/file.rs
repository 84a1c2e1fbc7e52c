//! Scene files: TOML, read with the line of every key, so that each fault is named
//! where it stands. The schema is described in docs/scene.md.

use super::bundled::{self, Bundled};
use super::deformer::{DEFORMERS_MAX, Deformer, Kind};
use super::keys::{Ease, Track};
use super::motion::CameraKeys;
use super::sequence::Pattern;
use super::{
    Error, Exits, Jitter, Light, March, Material, MeshSource, Method, Mixture, Request, Scattering,
    Single, Viewpoint, bytes, color, defaults, limits, names,
};
use glam::DVec3;
use std::path::Path;
use toml::Spanned;
use toml::de::{DeTable, DeValue};

const TOP: [&str; 11] = [
    "mesh",
    "unit",
    "material",
    "size",
    "exposure",
    "background",
    "light",
    "camera",
    "method",
    "name",
    "animation",
];
const MATERIAL: [&str; 7] = [
    "preset",
    "sigma_s",
    "sigma_a",
    "eta",
    "g",
    "roughness",
    "colored_by_mesh",
];
const LIGHT: [&str; 4] = ["azimuth", "elevation", "irradiance", "color"];
const CAMERA: [&str; 7] = [
    "azimuth",
    "elevation",
    "distance",
    "target",
    "eye",
    "up",
    "fov",
];
const METHOD: [&str; 19] = [
    "fetch_budget",
    "multiple",
    "samples",
    "rings",
    "moments",
    "fourth_from",
    "fourth_levels",
    "level_step",
    "volumes",
    "weights",
    "single",
    "exits",
    "scattering",
    "specular",
    "light_map",
    "frames_averaged",
    "jitter",
    "split",
    "split_at",
];

const ANIMATION: [&str; 7] = [
    "clip", "fps", "duration", "time", "deform", "light", "camera",
];
const DEFORM: [&str; 7] = [
    "kind",
    "axis",
    "towards",
    "amplitude",
    "period",
    "phase",
    "wavelength",
];
const MOVING: [&str; 3] = ["turns", "interpolation", "keys"];
const LIGHT_KEY: [&str; 5] = ["time", "azimuth", "elevation", "irradiance", "color"];
const CAMERA_KEY: [&str; 6] = ["time", "azimuth", "elevation", "distance", "target", "fov"];

/// What a fetch budget chooses, so that nothing else may.
const CHOSEN: [&str; 13] = [
    "multiple",
    "samples",
    "rings",
    "moments",
    "fourth_from",
    "fourth_levels",
    "level_step",
    "volumes",
    "weights",
    "single",
    "exits",
    "split",
    "split_at",
];

/// Reads a scene file. Paths in it are relative to its folder.
///
/// # Errors
/// The file cannot be read, is not TOML, or holds a key or value that is not known;
/// each is named with its line.
pub fn load(path: &Path) -> Result<Request, Error> {
    let name = path.display().to_string();
    let bytes = bytes::read(path)?;
    let text = bytes::utf8(&bytes, &name)?;
    let folder = path.parent().unwrap_or(Path::new(""));
    parse(text, &name, folder)
}

/// Parses the text of a scene file. `name` stands for the file in messages, and `folder`
/// is what paths in it are relative to.
///
/// # Errors
/// As [`load`], less what concerns reading.
pub fn parse(text: &str, name: &str, folder: &Path) -> Result<Request, Error> {
    let document = Document { name, text };
    let root = DeTable::parse(text).map_err(|fault| {
        let problem = format!(
            "not valid TOML: {}; write lines of key = value and [table]",
            fault.message()
        );
        match fault.span() {
            Some(span) => Error::at(name, document.line(span.start), problem),
            None => Error::of(name, problem),
        }
    })?;
    let top = Section::open(&document, "", root.get_ref(), &TOP)?;

    let mesh = match top.get("mesh") {
        Some(field) => field.mesh(folder)?,
        None => MeshSource::Bundled(Bundled::Statue20k),
    };
    let mut request = Request::of_mesh(name.to_owned(), mesh);
    top.read("name", Field::text, |value| request.name = value.to_owned())?;
    top.read("unit", |f| f.number(limits::positive), |v| request.unit = v)?;
    top.read("size", Field::size, |v| request.size = v)?;
    top.read(
        "exposure",
        |f| f.number(limits::positive),
        |v| request.exposure = v,
    )?;
    top.read("background", Field::background, |v| request.background = v)?;
    if let Some(field) = top.get("material") {
        (request.material, request.colored_by_mesh) = field.material()?;
    }
    if let Some(section) = top.section("light", &LIGHT)? {
        light(&section, &mut request.light)?;
    }
    if let Some(section) = top.section("camera", &CAMERA)? {
        section.read("fov", |f| f.number(limits::fov), |v| request.fov = v)?;
        request.viewpoint = viewpoint(&section)?;
    }
    if let Some(section) = top.section("method", &METHOD)? {
        method(&section, &mut request)?;
    }
    // Last: keyframes start from the light and the camera.
    if let Some(section) = top.section("animation", &ANIMATION)? {
        animation(&section, &mut request)?;
    }
    Ok(request)
}

fn animation(section: &Section, request: &mut Request) -> Result<(), Error> {
    let clip = |value: &str| request.animation.clip = Some(value.to_owned());
    section.read("clip", Field::text, clip)?;
    section.read(
        "fps",
        |f| f.number(limits::fps),
        |v| request.animation.fps = v,
    )?;
    section.read(
        "duration",
        |f| f.number(limits::duration),
        |v| request.animation.duration = Some(v),
    )?;
    section.read(
        "time",
        |f| f.number(limits::time),
        |v| request.time = Some(v),
    )?;
    if let Some(field) = section.get("deform") {
        let tables = field.tables("deform", &DEFORM)?;
        if tables.len() > DEFORMERS_MAX {
            return Err(field.error(&format!(
                "must have at most {DEFORMERS_MAX} tables, not {}",
                tables.len()
            )));
        }
        let deformers = tables.iter().map(deformer);
        request.animation.deformers = deformers.collect::<Result<_, _>>()?;
    }
    if let Some(section) = section.titled("light", "animation.light", &MOVING)? {
        light_motion(&section, request)?;
    }
    if let Some(section) = section.titled("camera", "animation.camera", &MOVING)? {
        camera_motion(&section, request)?;
    }
    Ok(())
}

fn deformer(section: &Section) -> Result<Deformer, Error> {
    let kind = section.required("kind", |f| f.named(Kind::named))?;
    let amplitude = section.required("amplitude", |f| f.number(|v| kind.amplitude(v)))?;
    let idle = [
        ("towards", kind.has_direction(), "a bend or a wave"),
        ("wavelength", kind.has_length(), "a wave"),
    ];
    for (key, used, of) in idle {
        if let Some(field) = section.get(key).filter(|_| !used) {
            return Err(field.error(&format!("is for {of}; drop it")));
        }
    }
    let number = |key, check: fn(f64) -> Result<f64, String>| {
        section.value(key, |field| field.number(check))
    };
    Ok(Deformer {
        kind,
        axis: section
            .value("axis", |f| f.vector(limits::direction))?
            .unwrap_or(DVec3::Y),
        towards: section.value("towards", |f| f.vector(limits::direction))?,
        amplitude,
        period: number("period", limits::positive)?.unwrap_or(defaults::DURATION),
        phase: number("phase", limits::finite)?.unwrap_or(0.0),
        wavelength: number("wavelength", limits::positive)?,
    })
}

/// Keyframes as they stand in a file.
struct Keyframes<'a> {
    times: Vec<f64>,
    tables: Vec<Section<'a>>,
    ease: Ease,
}

/// The keyframes of `section`, if it has any.
fn keyframes<'a>(section: &Section<'a>, known: &[&str]) -> Result<Option<Keyframes<'a>>, Error> {
    let ease = section.value("interpolation", |f| f.named(Ease::named))?;
    let Some(field) = section.get("keys") else {
        return match section.get("interpolation") {
            Some(field) => Err(field.error("has no effect without keys; drop it, or write keys")),
            None => Ok(None),
        };
    };
    let tables = field.tables("keys", known)?;
    if tables.is_empty() {
        return Err(field.error("must hold a keyframe, {time = 0, ...}"));
    }
    let mut times = Vec::new();
    for table in &tables {
        let time = table.required("time", |f| f.number(limits::non_negative))?;
        if times.last().is_some_and(|&last| last >= time) {
            return Err(table.at("time", "must be later than that of the key before"));
        }
        times.push(time);
    }
    Ok(Some(Keyframes {
        times,
        tables,
        ease: ease.unwrap_or_default(),
    }))
}

fn light_motion(section: &Section, request: &mut Request) -> Result<(), Error> {
    let animation = &mut request.animation;
    section.read(
        "turns",
        |f| f.number(limits::finite),
        |v| animation.light_turns = v,
    )?;
    let Some(Keyframes {
        times,
        tables,
        ease,
    }) = keyframes(section, &LIGHT_KEY)?
    else {
        return Ok(());
    };
    let values = tables.iter().map(|table| {
        let mut at = request.light.clone();
        light(table, &mut at)?;
        let [r, g, b] = at.color.to_array();
        Ok([at.azimuth, at.elevation, at.irradiance, r, g, b])
    });
    animation.light_keys = Some(Track {
        times,
        values: values.collect::<Result<_, Error>>()?,
        ease,
    });
    Ok(())
}

fn camera_motion(section: &Section, request: &mut Request) -> Result<(), Error> {
    let animation = &mut request.animation;
    section.read(
        "turns",
        |f| f.number(limits::finite),
        |v| animation.camera_turns = v,
    )?;
    let Some(Keyframes {
        times,
        tables,
        ease,
    }) = keyframes(section, &CAMERA_KEY)?
    else {
        return Ok(());
    };
    let Viewpoint::Orbit {
        azimuth,
        elevation,
        distance,
        target,
    } = request.viewpoint
    else {
        return Err(section.at(
            "keys",
            "are of a camera on an orbit; write azimuth and elevation in [camera] in place of eye",
        ));
    };
    let mut angles = Vec::new();
    let (mut distances, mut targets) = (Vec::new(), Vec::new());
    for table in &tables {
        let number = |key, check: fn(f64) -> Result<f64, String>| {
            table.value(key, |field| field.number(check))
        };
        angles.push([
            number("azimuth", limits::finite)?.unwrap_or(azimuth),
            number("elevation", limits::elevation)?.unwrap_or(elevation),
            number("fov", limits::fov)?.unwrap_or(request.fov),
        ]);
        distances.extend(number("distance", limits::positive)?.or(distance));
        let at = table.value("target", |f| f.vector(limits::point))?;
        targets.extend(at.or(target).map(|t| t.to_array()));
    }
    let all = |found: usize, key: &str| match found {
        0 => Ok(false),
        _ if found == tables.len() => Ok(true),
        _ => Err(section.at(
            "keys",
            &format!("have {key} in some only; write it in all of them, or in [camera]"),
        )),
    };
    let has_distance = all(distances.len(), "distance")?;
    let has_target = all(targets.len(), "target")?;
    animation.camera_keys = Some(CameraKeys {
        distance: has_distance.then(|| Track {
            times: times.clone(),
            values: distances.iter().map(|&d| [d]).collect(),
            ease,
        }),
        target: has_target.then(|| Track {
            times: times.clone(),
            values: targets,
            ease,
        }),
        angles: Track {
            times,
            values: angles,
            ease,
        },
    });
    Ok(())
}

fn light(section: &Section, light: &mut Light) -> Result<(), Error> {
    section.read(
        "azimuth",
        |f| f.number(limits::finite),
        |v| light.azimuth = v,
    )?;
    section.read(
        "elevation",
        |f| f.number(limits::elevation),
        |v| light.elevation = v,
    )?;
    section.read(
        "irradiance",
        |f| f.number(limits::non_negative),
        |v| light.irradiance = v,
    )?;
    section.read("color", Field::color, |v| light.color = v)
}

fn viewpoint(section: &Section) -> Result<Viewpoint, Error> {
    let point = |key| section.value(key, |f| f.vector(limits::point));
    let Some(eye_field) = section.get("eye") else {
        if let Some(up) = section.get("up") {
            return Err(up.error("needs eye and target; an orbit is always upright"));
        }
        let angle = |key, check: fn(f64) -> Result<f64, String>| {
            section.value(key, |field| field.number(check))
        };
        return Ok(Viewpoint::Orbit {
            azimuth: angle("azimuth", limits::finite)?.unwrap_or(defaults::CAMERA_AZIMUTH),
            elevation: angle("elevation", limits::elevation)?.unwrap_or(defaults::CAMERA_ELEVATION),
            distance: angle("distance", limits::positive)?,
            target: point("target")?,
        });
    };
    for key in ["azimuth", "elevation", "distance"] {
        if let Some(field) = section.get(key) {
            return Err(field.error(
                "cannot be combined with eye; choose an orbit (azimuth, elevation, distance, \
                 target) or a position (eye, target, up)",
            ));
        }
    }
    let eye = eye_field.vector(limits::point)?;
    let target =
        point("target")?.ok_or_else(|| eye_field.error("needs target, the point to look at"))?;
    let up = point("up")?.unwrap_or(DVec3::Y);
    let viewpoint = Viewpoint::At { eye, target, up };
    // A position needs no mesh, so its faults can be named here, with the line.
    viewpoint
        .camera(defaults::CAMERA_FOV, defaults::SIZE, &[])
        .map_err(|phrase| eye_field.error(&format!("is unusable: {phrase}")))?;
    Ok(viewpoint)
}

fn method(section: &Section, request: &mut Request) -> Result<(), Error> {
    if let Some(field) = section.get("fetch_budget") {
        request.fetch_budget = Some(field.whole(limits::budget)?);
        if let Some(key) = CHOSEN.into_iter().find(|key| section.get(key).is_some()) {
            return Err(field.error(&format!(
                "chooses the methods of scattering, {key} among them; drop one of the two"
            )));
        }
    }
    let named = |field: &Field| field.named(Method::named);
    section.read("multiple", named, |v| request.multiple = v)?;
    section.read("split", named, |v| request.split = Some(v))?;
    section.read(
        "split_at",
        |f| f.number(limits::share),
        |v| request.split_at = v,
    )?;
    section.read(
        "samples",
        |f| f.whole(limits::samples),
        |v| request.samples = v,
    )?;
    section.read("rings", |f| f.whole(limits::rings), |v| request.rings = v)?;
    section.read(
        "moments",
        |f| f.whole(limits::moments),
        |v| request.moments = v,
    )?;
    section.read(
        "fourth_from",
        |f| f.whole(limits::level),
        |v| request.fourth_from = v,
    )?;
    section.read(
        "fourth_levels",
        |f| f.whole(limits::fourth_levels),
        |v| request.fourth_levels = Some(v),
    )?;
    section.read(
        "level_step",
        |f| f.whole(limits::level_step),
        |v| request.level_step = v,
    )?;
    section.read(
        "volumes",
        |f| f.whole(limits::volumes),
        |v| request.volumes = v,
    )?;
    section.read(
        "weights",
        |f| f.named(Mixture::weights),
        |v| request.weights = v,
    )?;
    section.read("single", Field::single, |v| request.single = v)?;
    section.read("exits", |f| f.named(Exits::named), |v| request.exits = v)?;
    section.read(
        "scattering",
        |f| f.named(Scattering::named),
        |v| request.scattering = v,
    )?;
    section.read(
        "light_map",
        |f| f.whole(limits::light_map),
        |v| request.light_map = v,
    )?;
    section.read("specular", Field::truth, |v| request.specular = v)?;
    section.read(
        "frames_averaged",
        |f| f.whole(limits::frames_averaged),
        |v| request.frames_averaged = Some(v),
    )?;
    section.read("jitter", |f| f.named(Jitter::named), |v| request.jitter = v)
}

/// A file as messages need it.
struct Document<'a> {
    name: &'a str,
    text: &'a str,
}

impl Document<'_> {
    /// The line, counted from 1, of a byte offset.
    fn line(&self, offset: usize) -> usize {
        1 + self
            .text
            .bytes()
            .take(offset)
            .filter(|&b| b == b'\n')
            .count()
    }
}

/// One table whose keys are all known.
struct Section<'a> {
    document: &'a Document<'a>,
    /// Empty for the top of the file.
    title: &'a str,
    table: &'a DeTable<'a>,
}

impl<'a> Section<'a> {
    /// Opens a table and refuses its first unknown key.
    fn open(
        document: &'a Document<'a>,
        title: &'a str,
        table: &'a DeTable<'a>,
        known: &[&str],
    ) -> Result<Self, Error> {
        let first_unknown = table
            .keys()
            .filter(|key| !known.contains(&key.get_ref().as_ref()))
            .min_by_key(|key| key.span().start);
        let Some(key) = first_unknown else {
            return Ok(Section {
                document,
                title,
                table,
            });
        };
        let name = key.get_ref().as_ref();
        let within = match title {
            "" => String::new(),
            _ => format!(" in [{title}]"),
        };
        let remedy = if !title.is_empty() && TOP.contains(&name) {
            // The commonest slip in TOML: a key of the file under the last table.
            "it belongs above the first [table]".to_owned()
        } else {
            names::remedy(name, known)
        };
        Err(Error::at(
            document.name,
            document.line(key.span().start),
            format!("unknown key \"{name}\"{within}; {remedy}"),
        ))
    }

    fn get(&self, key: &'a str) -> Option<Field<'a>> {
        let (found, value) = self.table.get_key_value(key)?;
        Some(Field {
            document: self.document,
            section: self.title,
            key,
            offset: found.span().start,
            value,
        })
    }

    /// The value of a key, if it is given.
    fn value<T>(
        &self,
        key: &'a str,
        read: impl FnOnce(&Field<'a>) -> Result<T, Error>,
    ) -> Result<Option<T>, Error> {
        self.get(key).map(|field| read(&field)).transpose()
    }

    /// Hands the value of a key on, if it is given.
    fn read<T>(
        &self,
        key: &'a str,
        read: impl FnOnce(&Field<'a>) -> Result<T, Error>,
        write: impl FnOnce(T),
    ) -> Result<(), Error> {
        self.value(key, read).map(|value| {
            if let Some(value) = value {
                write(value);
            }
        })
    }

    /// The value of a key that must be given.
    fn required<T>(
        &self,
        key: &'a str,
        read: impl FnOnce(&Field<'a>) -> Result<T, Error>,
    ) -> Result<T, Error> {
        match self.value(key, read)? {
            Some(value) => Ok(value),
            None => Err(self.at("", &format!("needs {key}"))),
        }
    }

    /// A fault of `key`, or where it is not given of the table.
    fn at(&self, key: &'a str, phrase: &str) -> Error {
        if let Some(field) = self.get(key) {
            return field.error(phrase);
        }
        let first = self.table.keys().map(|key| key.span().start).min();
        let problem = format!("a table of [{}] {phrase}", self.title);
        match first {
            Some(offset) => Error::at(self.document.name, self.document.line(offset), problem),
            None => Error::of(self.document.name, problem),
        }
    }

    fn section(&self, key: &'a str, known: &[&str]) -> Result<Option<Section<'a>>, Error> {
        self.titled(key, key, known)
    }

    /// The table under `key`, whose full name is `title`.
    fn titled(
        &self,
        key: &'a str,
        title: &'a str,
        known: &[&str],
    ) -> Result<Option<Section<'a>>, Error> {
        let Some(field) = self.get(key) else {
            return Ok(None);
        };
        match field.value.get_ref() {
            DeValue::Table(table) => Section::open(self.document, title, table, known).map(Some),
            _ => Err(field.must_be(&format!("a table, [{title}] on a line of its own"))),
        }
    }
}

/// One key with its value.
struct Field<'a> {
    document: &'a Document<'a>,
    section: &'a str,
    key: &'a str,
    offset: usize,
    value: &'a Spanned<DeValue<'a>>,
}

impl<'a> Field<'a> {
    /// A fault of this key; `phrase` reads on from its name.
    fn error(&self, phrase: &str) -> Error {
        let within = match self.section {
            "" => String::new(),
            section => format!(" in [{section}]"),
        };
        Error::at(
            self.document.name,
            self.document.line(self.offset),
            format!("{}{within} {phrase}", self.key),
        )
    }

    /// The value has another type than `what`.
    fn must_be(&self, what: &str) -> Error {
        let found = match self.value.get_ref() {
            DeValue::String(text) => format!("\"{text}\""),
            DeValue::Integer(number) => number.to_string(),
            DeValue::Float(number) => number.to_string(),
            DeValue::Boolean(truth) => truth.to_string(),
            DeValue::Datetime(_) => "a date".to_owned(),
            DeValue::Array(array) => format!("an array of {}", array.len()),
            DeValue::Table(_) => "a table".to_owned(),
        };
        self.error(&format!("must be {what}, not {found}"))
    }

    fn checked<T>(&self, result: Result<T, String>) -> Result<T, Error> {
        result.map_err(|phrase| self.error(&phrase))
    }

    fn number(&self, check: impl Fn(f64) -> Result<f64, String>) -> Result<f64, Error> {
        let value = float(self.value.get_ref()).ok_or_else(|| self.must_be("a number"))?;
        self.checked(check(value))
    }

    fn whole<T>(&self, check: impl Fn(i64) -> Result<T, String>) -> Result<T, Error> {
        let value = integer(self.value.get_ref()).ok_or_else(|| self.must_be("a whole number"))?;
        self.checked(check(value))
    }

    /// An array of tables, which together are called `title`.
    fn tables(&self, title: &'a str, known: &[&str]) -> Result<Vec<Section<'a>>, Error> {
        let wrong = || self.must_be("an array of tables, [{...}, {...}]");
        let array = self.value.get_ref().as_array().ok_or_else(wrong)?;
        let tables = array.iter().map(|value| match value.get_ref() {
            DeValue::Table(table) => Section::open(self.document, title, table, known),
            _ => Err(wrong()),
        });
        tables.collect()
    }

    fn truth(&self) -> Result<bool, Error> {
        self.value
            .get_ref()
            .as_bool()
            .ok_or_else(|| self.must_be("true or false"))
    }

    fn single(&self) -> Result<Single, Error> {
        match self.value.get_ref() {
            DeValue::String(text) => match text.as_ref() {
                "off" => Ok(Single::Off),
                "traced" => Ok(Single::Traced),
                _ => Err(self.must_be("a whole number, \"off\" or \"traced\"")),
            },
            DeValue::Integer(_) => self.whole(limits::steps).map(|steps| {
                Single::March(March {
                    steps,
                    exits: Exits::Linear,
                })
            }),
            _ => Err(self.must_be("a whole number, \"off\" or \"traced\"")),
        }
    }

    fn text(&self) -> Result<&'a str, Error> {
        match self.value.get_ref() {
            DeValue::String(text) => Ok(text),
            _ => Err(self.must_be("a text in quotes")),
        }
    }

    fn named<T>(&self, named: impl Fn(&str) -> Result<T, String>) -> Result<T, Error> {
        let name = self.text()?;
        named(name).map_err(|phrase| self.error(&format!("names an {phrase}")))
    }

    fn vector(&self, check: impl Fn(DVec3) -> Result<DVec3, String>) -> Result<DVec3, Error> {
        let wrong = || self.must_be("an array of 3 numbers");
        let array = self.value.get_ref().as_array().ok_or_else(wrong)?;
        let numbers: Vec<f64> = array
            .iter()
            .map(|value| float(value.get_ref()))
            .collect::<Option<_>>()
            .ok_or_else(|| self.error("must be an array of 3 numbers and hold nothing else"))?;
        match numbers[..] {
            [x, y, z] => self.checked(check(DVec3::new(x, y, z))),
            _ => Err(wrong()),
        }
    }

    fn size(&self) -> Result<[u32; 2], Error> {
        let wrong = || self.must_be("an array of 2 whole numbers, [width, height]");
        let array = self.value.get_ref().as_array().ok_or_else(wrong)?;
        let numbers: Vec<i64> = array
            .iter()
            .map(|value| integer(value.get_ref()))
            .collect::<Option<_>>()
            .ok_or_else(|| self.error("must be 2 whole numbers, [width, height]"))?;
        match numbers[..] {
            [width, height] => self.checked(limits::size([width, height])),
            _ => Err(wrong()),
        }
    }

    fn color(&self) -> Result<DVec3, Error> {
        match self.value.get_ref() {
            DeValue::String(text) => self.checked(color::parse_hex(text)).map(DVec3::from_array),
            DeValue::Array(_) => self.vector(limits::color),
            _ => Err(self.must_be("\"#rrggbb\" or [r, g, b] in linear light")),
        }
    }

    fn background(&self) -> Result<Option<[f64; 3]>, Error> {
        match self.value.get_ref() {
            DeValue::String(text) if text == "none" => Ok(None),
            DeValue::String(hex) => color::parse_hex(hex)
                .map(Some)
                .map_err(|phrase| self.error(&phrase.replace("must be", "must be \"none\" or"))),
            DeValue::Array(_) => self.vector(limits::color).map(|c| Some(c.to_array())),
            _ => Err(self.must_be("\"none\", \"#rrggbb\" or [r, g, b] in linear light")),
        }
    }

    fn mesh(&self, folder: &Path) -> Result<MeshSource, Error> {
        let name = self.text()?;
        if let Some(bundled) = Bundled::named(name) {
            return Ok(MeshSource::Bundled(bundled));
        }
        let path = folder.join(name);
        if !MeshSource::is_mesh(&path) {
            let remedy = names::remedy(name, &bundled::NAMES);
            return Err(self.error(&format!(
                "\"{name}\" is neither an .obj, .gltf or .glb file nor a bundled mesh; {remedy}"
            )));
        }
        // Which files a sequence has is known when it is loaded.
        if self.checked(Pattern::of(&path))?.is_some() {
            return Ok(MeshSource::File(path));
        }
        // Looked for here, while the line is known.
        if !path.exists() {
            return Err(self.error(&format!(
                "names \"{}\", which does not exist; paths are relative to the scene file",
                path.display()
            )));
        }
        Ok(MeshSource::File(path))
    }

    /// The material, and whether a colour in the mesh file takes its place.
    fn material(&self) -> Result<(Material, bool), Error> {
        let table = match self.value.get_ref() {
            DeValue::String(name) => return Ok((self.checked_preset(name)?, false)),
            DeValue::Table(table) => table,
            _ => return Err(self.must_be("a preset's name or a table [material]")),
        };
        let section = Section::open(self.document, "material", table, &MATERIAL)?;
        let preset = match section.get("preset") {
            Some(field) => Some(field.checked_preset(field.text()?)?),
            None => None,
        };
        let sigma_s = section.value("sigma_s", |f| f.vector(limits::sigma_s))?;
        let sigma_a = section.value("sigma_a", |f| f.vector(limits::sigma_a))?;
        let eta = section.value("eta", |f| f.number(limits::eta))?;
        let g = section.value("g", |f| f.number(limits::g))?;
        let roughness = section.value("roughness", |f| f.number(limits::roughness))?;
        let colored = section.value("colored_by_mesh", Field::truth)?;
        let overridden = sigma_s.is_some() || sigma_a.is_some() || eta.is_some() || g.is_some();
        let base = match (preset, sigma_s, sigma_a) {
            (Some(preset), ..) => preset,
            (None, Some(sigma_s), Some(sigma_a)) => Material {
                name: "custom".to_owned(),
                sigma_s,
                sigma_a,
                eta: defaults::ETA,
                g: defaults::G,
                roughness: defaults::ROUGHNESS,
            },
            (None, ..) => {
                return Err(self.error("needs sigma_s and sigma_a, or a preset to start from"));
            }
        };
        let material = Material {
            name: if overridden {
                "custom".to_owned()
            } else {
                base.name
            },
            sigma_s: sigma_s.unwrap_or(base.sigma_s),
            sigma_a: sigma_a.unwrap_or(base.sigma_a),
            eta: eta.unwrap_or(base.eta),
            g: g.unwrap_or(base.g),
            roughness: roughness.unwrap_or(base.roughness),
        };
        Ok((material, colored.unwrap_or(false)))
    }

    fn checked_preset(&self, name: &str) -> Result<Material, Error> {
        Material::preset(name).map_err(|phrase| self.error(&format!("names an {phrase}")))
    }
}

fn integer(value: &DeValue) -> Option<i64> {
    let number = value.as_integer()?;
    i64::from_str_radix(number.as_str(), number.radix()).ok()
}

/// Whole numbers serve as numbers too.
fn float(value: &DeValue) -> Option<f64> {
    match value {
        DeValue::Integer(_) => integer(value).map(|number| number as f64),
        DeValue::Float(number) => number.as_str().parse().ok(),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ok(text: &str) -> Request {
        parse(text, "s.toml", Path::new("")).expect("a good scene")
    }

    fn fault(text: &str) -> String {
        parse(text, "s.toml", Path::new(""))
            .expect_err("a bad scene")
            .to_string()
    }

    #[test]
    fn nothing_means_every_default() {
        let mut expected = Request::statue();
        expected.name = "s.toml".to_owned();
        assert_eq!(ok(""), expected);
    }

    #[test]
    fn the_bundled_example_spells_out_the_defaults() {
        let text = include_str!(concat!(
            env!("CARGO_MANIFEST_DIR"),
            "/assets/scenes/statue.toml"
        ));
        let mut found = ok(text);
        // Pi is written with fewer digits than it has.
        assert!((found.light.irradiance - defaults::LIGHT_IRRADIANCE).abs() < 1e-12);
        found.light.irradiance = defaults::LIGHT_IRRADIANCE;
        assert_eq!(
            found.frames_averaged.take(),
            Some(defaults::FRAMES_AVERAGED)
        );
        // It names a material, so that no mesh chooses one.
        assert!(!std::mem::replace(&mut found.colored_by_mesh, true));
        found.name = "statue".to_owned();
        assert_eq!(found, Request::statue());
    }

    #[test]
    fn every_key_is_read() {
        let request = ok("
            name = \"test\"
            mesh = \"statue-1k\"
            unit = 2
            size = [64, 0x20]
            exposure = 0.5
            background = \"#ffffff\"
            [material]
            preset = \"skin1\"
            eta = 1.4
            roughness = 0.2
            [light]
            azimuth = -10
            elevation = 5.5
            irradiance = 2
            color = [1, 0.5, 0]
            [camera]
            eye = [0, 0, 50]
            target = [0, 1, 0]
            fov = 40
            [method]
            multiple = \"exact\"
            split = \"brdf\"
            split_at = 0.25
            samples = 7
            specular = false
            light_map = 128
            frames_averaged = 3
            jitter = \"samples\"
        ");
        assert_eq!(request.name, "test");
        assert_eq!(request.mesh, MeshSource::Bundled(Bundled::Statue1k));
        assert_eq!(
            (request.unit, request.exposure, request.fov),
            (2.0, 0.5, 40.0)
        );
        assert_eq!(request.size, [64, 32]);
        assert_eq!(request.background, Some([1.0; 3]));
        assert_eq!(request.material.name, "custom");
        assert_eq!(
            (request.material.eta, request.material.roughness),
            (1.4, 0.2)
        );
        assert_eq!(request.material.sigma_s, DVec3::new(0.74, 0.88, 1.01));
        assert_eq!(request.light.color, DVec3::new(1.0, 0.5, 0.0));
        assert_eq!(
            (request.light.azimuth, request.light.elevation),
            (-10.0, 5.5)
        );
        assert!(matches!(
            request.viewpoint,
            Viewpoint::At { up: DVec3::Y, .. }
        ));
        assert_eq!(request.multiple, Method::Exact);
        assert_eq!(
            (request.split, request.split_at),
            (Some(Method::Brdf), 0.25)
        );
        assert_eq!(
            (request.samples, request.light_map, request.frames_averaged),
            (7, 128, Some(3))
        );
        assert!(!request.specular);
        assert_eq!(request.jitter, Jitter::Samples);
    }

    #[test]
    fn faults_name_line_key_and_remedy() {
        for (text, fragments) in [
            (
                "\n[light]\nazimut = 3\n",
                &[
                    "s.toml:3: ",
                    "\"azimut\" in [light]",
                    "did you mean \"azimuth\"?",
                ][..],
            ),
            (
                "[light]\nsize = [1, 2]\n",
                &[":2: ", "above the first [table]"],
            ),
            ("lihgt = 3\n", &[":1: ", "did you mean \"light\"?"]),
            ("xyzzy = 3\n", &[":1: ", "one of mesh, unit"]),
            (
                "[light]\nazimuth = \"left\"\n",
                &[":2: ", "azimuth in [light]", "a number, not \"left\""],
            ),
            (
                "[light]\nelevation = 91\n",
                &[":2: ", "from -90 to 90 degrees, not 91"],
            ),
            ("[light]\nirradiance = nan\n", &[":2: ", "NaN"]),
            ("[light]\ncolor = \"red\"\n", &[":2: ", "#rrggbb"]),
            ("[light]\ncolor = 3\n", &[":2: ", "linear light"]),
            ("light = 3\n", &[":1: ", "a table, [light]"]),
            (
                "material = \"marbel\"\n",
                &[":1: ", "did you mean \"marble\"?"],
            ),
            ("material = 3\n", &[":1: ", "a preset's name"]),
            (
                "\n[material]\nsigma_s = [1, 1, 1]\n",
                &[":2: ", "needs sigma_s and sigma_a"],
            ),
            (
                "[material]\nsigma_s = [1, 0, 1]\n",
                &[":2: ", "sigma_s in [material]", "greater than 0"],
            ),
            (
                "[material]\nsigma_a = [1, 0]\n",
                &[":2: ", "an array of 3 numbers, not an array of 2"],
            ),
            (
                "[material]\nsigma_a = [1, 0, \"x\"]\n",
                &[":2: ", "hold nothing else"],
            ),
            (
                "size = [0, 600]\n",
                &[":1: ", "size must have sides from 1 to 16384", "width of 0"],
            ),
            ("size = [800.5, 600]\n", &[":1: ", "2 whole numbers"]),
            (
                "size = \"800x600\"\n",
                &[":1: ", "[width, height], not \"800x600\""],
            ),
            ("unit = 0\n", &[":1: ", "greater than 0, not 0"]),
            ("background = \"white\"\n", &[":1: ", "\"none\" or #rrggbb"]),
            (
                "background = 3\n",
                &[":1: ", "[r, g, b] in linear light, not 3"],
            ),
            (
                "background = [0, 0, -1]\n",
                &[":1: ", "0 or greater", "not -1"],
            ),
            (
                "[material]\npreset = \"skin1\"\ncolored_by_mesh = 1\n",
                &[":3: ", "true or false, not 1"],
            ),
            (
                "[method]\nsplit = \"brdf\"\nsplit_at = 1.5\n",
                &[":3: ", "split_at in [method]", "from 0 to 1, not 1.5"],
            ),
            ("mesh = \"statu\"\n", &[":1: ", "did you mean \"statue\"?"]),
            (
                "mesh = \"gone.obj\"\n",
                &[":1: ", "does not exist", "relative to the scene file"],
            ),
            (
                "[method]\nmultiple = \"sample\"\n",
                &[":2: ", "did you mean \"samples\"?"],
            ),
            ("[method]\nsamples = 0\n", &[":2: ", "from 1 to 256, not 0"]),
            (
                "[method]\nsamples = 1.5\n",
                &[":2: ", "a whole number, not 1.5"],
            ),
            (
                "[method]\nspecular = \"on\"\n",
                &[":2: ", "true or false, not \"on\""],
            ),
            ("[camera]\neye = [0, 0, 1]\n", &[":2: ", "needs target"]),
            ("[camera]\nup = [0, 0, 1]\n", &[":2: ", "needs eye"]),
            (
                "[camera]\neye = [0, 0, 1]\ndistance = 3\n",
                &[":3: ", "cannot be combined with eye"],
            ),
            (
                "[camera]\neye = [0, 0, 1]\ntarget = [0, 0, 1]\n",
                &[":2: ", "same point"],
            ),
            ("a = \n", &[":1: ", "not valid TOML"]),
            (
                "unit = 1\nunit = 2\n",
                &[":2: ", "not valid TOML", "duplicate"],
            ),
        ] {
            let message = fault(text);
            assert_eq!(message.lines().count(), 1, "{message}");
            for fragment in fragments {
                assert!(message.contains(fragment), "{text:?}: {message}");
            }
        }
    }
}
