//! The table of shaders, and how one is compiled. `build.rs` takes this file in as well, so that a shader that is
//! compiled while the program runs is what it would be in a new build.

use std::path::Path;

use shaderc::ShaderKind;

/// Every shader of the frame but those that shade: file, variant, and the macros that make the variant.
const SHADERS: &[(&str, &str, &[&str])] = &[
    ("deform.comp", "", &[]),
    ("light.vert", "", &[]),
    ("light.frag", "", &[]),
    ("light.frag", "fourth", &["FOURTH"]),
    ("view.vert", "", &[]),
    ("view.frag", "", &[]),
    ("view.vert", "motion", &["MOTION"]),
    ("view.frag", "motion", &["MOTION"]),
    ("shade.vert", "", &[]),
    ("decimate.comp", "", &[]),
    ("decimate.comp", "fourth", &["FOURTH"]),
    ("smooth.comp", "", &[]),
    ("smooth.comp", "fourth", &["FOURTH"]),
    ("volume.comp", "", &[]),
    ("volume_halve.comp", "", &[]),
    ("volume_blur.comp", "", &[]),
    ("boxes.comp", "", &[]),
    ("boxes_shared.comp", "", &[]),
    ("exact.comp", "", &[]),
    ("probe.frag", "", &[]),
    ("probe.frag", "texel", &["TEXEL"]),
    ("probe.frag", "gather", &["GATHER"]),
    ("probe.frag", "volume", &["VOLUME"]),
    ("probe.frag", "storage", &["STORAGE"]),
    ("probe.frag", "storage scalar", &["STORAGE_SCALAR"]),
    // Scattering comes from the picture of half the size.
    ("shade.frag", "half", &["METHOD_HALF"]),
    ("resolve.frag", "", &[]),
    ("resolve.frag", "encode", &["ENCODE"]),
    // Live display: each frame is joined with a history, and shown.
    ("resolve.frag", "live", &["ENCODE", "LIVE"]),
    (
        "resolve.frag",
        "live nearest",
        &["ENCODE", "LIVE", "NO_LINEAR"],
    ),
    // The window.
    ("compose.frag", "", &[]),
    ("panel.vert", "", &[]),
    ("panel.frag", "", &[]),
];

/// The shaders that shade, by their method for multiple scattering.
const SHADE: &[(&str, &[&str])] = &[
    ("none", &["METHOD_NONE"]),
    ("brdf", &["METHOD_BRDF"]),
    ("samples", &["METHOD_SAMPLES"]),
    ("rings", &["METHOD_RINGS"]),
    ("rings nearest", &["METHOD_RINGS", "NO_LINEAR"]),
    ("mixture", &["METHOD_MIXTURE"]),
    ("mixture nearest", &["METHOD_MIXTURE", "NO_LINEAR"]),
    ("mixture fourth", &["METHOD_MIXTURE", "FOURTH"]),
    (
        "mixture nearest fourth",
        &["METHOD_MIXTURE", "NO_LINEAR", "FOURTH"],
    ),
    ("mixture volumes", &["METHOD_MIXTURE", "VOLUMES"]),
    (
        "mixture fourth volumes",
        &["METHOD_MIXTURE", "FOURTH", "VOLUMES"],
    ),
    (
        "mixture nearest volumes",
        &["METHOD_MIXTURE", "NO_LINEAR", "VOLUMES"],
    ),
    (
        "mixture nearest fourth volumes",
        &["METHOD_MIXTURE", "NO_LINEAR", "FOURTH", "VOLUMES"],
    ),
];

/// Each of them without single scattering, with it, and with it from the depth buffer.
const SINGLE: &[(&str, &[&str])] = &[
    ("", &[]),
    ("single", &["SINGLE"]),
    ("single depth", &["SINGLE", "EXITS_DEPTH"]),
];

/// The builds of a shader, by the macro that makes them.
pub const BUILDS: [Option<&str>; 3] = [None, Some("COUNTING"), Some("FLOOR")];

/// A copy of a shader with a read that nobody declared, so that tests can see the ledger catch it: the file, where the
/// read goes in, and the read.
const STRAY: (&str, &str, &str) = (
    "shade.frag",
    "    out_radiance = vec4(radiance",
    "    radiance += 1e-6 * texture(moments, vec2(0.5)).rgb;\n",
);

/// Something to compile.
pub struct Job {
    pub file: &'static str,
    variant: String,
    macros: Vec<&'static str>,
    stray: bool,
}

/// Every shader of the table.
pub fn jobs() -> Vec<Job> {
    let shade = SHADE.iter().flat_map(|(method, macros)| {
        SINGLE.iter().map(move |(single, more)| Job {
            file: "shade.frag",
            variant: format!("{method} {single}").trim().to_owned(),
            macros: [*macros, *more].concat(),
            stray: false,
        })
    });
    let others = SHADERS.iter().map(|&(file, variant, macros)| Job {
        file,
        variant: variant.to_owned(),
        macros: macros.to_vec(),
        stray: false,
    });
    let stray = Job {
        file: STRAY.0,
        variant: "stray".to_owned(),
        macros: vec!["METHOD_MIXTURE"],
        stray: true,
    };
    others.chain(shade).chain([stray]).collect()
}

impl Job {
    /// File and variant, as "shade.frag samples".
    pub fn name(&self) -> String {
        format!("{} {}", self.file, self.variant).trim().to_owned()
    }
}

/// Whether a file is a shader or part of one, by its ending. Hidden files are none: Emacs locks a file by one whose name
/// ends like it.
pub fn is_shader(path: &Path) -> bool {
    let name = path.file_name().and_then(|name| name.to_str());
    if name.is_none_or(|name| name.starts_with('.')) {
        return false;
    }
    let ending = path.extension().and_then(|ending| ending.to_str());
    ending.is_some_and(|ending| ["vert", "frag", "comp", "glsl"].contains(&ending))
}

/// The stage of a file, by its ending.
pub fn kind(file: &str) -> Result<ShaderKind, String> {
    match Path::new(file).extension().and_then(|e| e.to_str()) {
        Some("vert") => Ok(ShaderKind::Vertex),
        Some("frag") => Ok(ShaderKind::Fragment),
        Some("comp") => Ok(ShaderKind::Compute),
        other => Err(format!("{file}: unknown shader stage {other:?}")),
    }
}

/// Compiles one build of a shader to SPIR-V, from the files that `read` gives by their names; empty where there is no
/// such build.
pub fn compile(
    compiler: &shaderc::Compiler,
    job: &Job,
    build: Option<&str>,
    read: &dyn Fn(&str) -> Result<String, String>,
) -> Result<Vec<u8>, String> {
    if build == Some("FLOOR") && job.file != "shade.frag" {
        return Ok(Vec::new());
    }
    let mut source = read(job.file)?;
    if job.stray {
        let (_, before, text) = STRAY;
        if !source.contains(before) {
            return Err(format!("{}: no line starts {before:?}", job.file));
        }
        source = source.replacen(before, &format!("{text}{before}"), 1);
    }
    let mut options = shaderc::CompileOptions::new()
        .map_err(|e| format!("shaderc gives no compile options: {e}"))?;
    options.set_target_env(
        shaderc::TargetEnv::Vulkan,
        shaderc::EnvVersion::Vulkan1_3 as u32,
    );
    options.set_optimization_level(shaderc::OptimizationLevel::Performance);
    options.set_warnings_as_errors();
    options.set_generate_debug_info();
    for name in &job.macros {
        options.add_macro_definition(name, None);
    }
    if let Some(build) = build {
        options.add_macro_definition(build, None);
    }
    options.set_include_callback(|name, _, from, _| {
        let content = read(name).map_err(|e| format!("{from} includes {e}"))?;
        Ok(shaderc::ResolvedInclude {
            resolved_name: name.to_owned(),
            content,
        })
    });
    let compiled = compiler
        .compile_into_spirv(&source, kind(job.file)?, job.file, "main", Some(&options))
        .map_err(|e| format!("{}: {e}", job.name()))?;
    Ok(compiled.as_binary_u8().to_vec())
}
