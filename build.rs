//! Compiles the shaders to SPIR-V and writes a typed table of them, so that a shader that
//! does not compile, or a name that does not exist, is a build error.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::{env, fs};

/// Every shader of the frame but those that shade: file, variant, and the macros that make the variant.
const SHADERS: &[(&str, &str, &[&str])] = &[
    ("light.vert", "", &[]),
    ("light.frag", "", &[]),
    ("light.frag", "fourth", &["FOURTH"]),
    ("view.vert", "", &[]),
    ("view.frag", "", &[]),
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
    ("resolve.frag", "", &[]),
    ("resolve.frag", "encode", &["ENCODE"]),
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

fn main() {
    if let Err(message) = run() {
        // One clear block on stderr in place of a backtrace.
        eprintln!("\n{message}\n");
        std::process::exit(1);
    }
}

fn run() -> Result<(), String> {
    let folder = Path::new("shaders");
    println!("cargo:rerun-if-changed=shaders");
    println!("cargo:rerun-if-changed=build.rs");

    let compiler = shaderc::Compiler::new().map_err(|e| format!("shaderc does not start: {e}"))?;
    let mut table = String::from("// Written by build.rs.\n");
    let shade = SHADE.iter().flat_map(|(method, macros)| {
        SINGLE.iter().map(move |(single, more)| {
            let variant = format!("{method} {single}");
            (
                "shade.frag",
                variant.trim().to_owned(),
                [*macros, *more].concat(),
            )
        })
    });
    let others = SHADERS
        .iter()
        .map(|&(file, variant, macros)| (file, variant.to_owned(), macros.to_vec()));
    for (file, variant, macros) in others.chain(shade) {
        let path = folder.join(file);
        let source = read(&path)?;
        let stage = match path.extension().and_then(|e| e.to_str()) {
            Some("vert") => (shaderc::ShaderKind::Vertex, "VERTEX"),
            Some("frag") => (shaderc::ShaderKind::Fragment, "FRAGMENT"),
            Some("comp") => (shaderc::ShaderKind::Compute, "COMPUTE"),
            other => return Err(format!("{file}: unknown shader stage {other:?}")),
        };
        let mut options = shaderc::CompileOptions::new()
            .map_err(|e| format!("shaderc gives no compile options: {e}"))?;
        options.set_target_env(
            shaderc::TargetEnv::Vulkan,
            shaderc::EnvVersion::Vulkan1_3 as u32,
        );
        options.set_optimization_level(shaderc::OptimizationLevel::Performance);
        options.set_warnings_as_errors();
        for name in macros {
            options.add_macro_definition(name, None);
        }
        options.set_include_callback(|name, _, from, _| {
            let path = folder.join(name);
            let content = fs::read_to_string(&path)
                .map_err(|e| format!("{from} includes {}: {e}", path.display()))?;
            Ok(shaderc::ResolvedInclude {
                resolved_name: name.to_owned(),
                content,
            })
        });
        let compiled = compiler
            .compile_into_spirv(
                &source,
                stage.0,
                &path.to_string_lossy(),
                "main",
                Some(&options),
            )
            .map_err(|e| format!("{}: {e}", path.display()))?;

        let name = format!("{file} {variant}");
        let name = name.trim();
        let constant = name.replace(['.', ' ', '-'], "_").to_uppercase();
        writeln!(
            table,
            "/// `{name}`\npub const {constant}: Shader = Shader {{ name: {name:?}, \
             stage: ash::vk::ShaderStageFlags::{}, spirv: &{:?} }};",
            stage.1,
            compiled.as_binary()
        )
        .map_err(|e| e.to_string())?;
    }
    let out = env::var_os("OUT_DIR").ok_or("cargo sets no OUT_DIR")?;
    let out = PathBuf::from(out).join("shaders.rs");
    fs::write(&out, table).map_err(|e| format!("{}: {e}", out.display()))
}

fn read(path: &Path) -> Result<String, String> {
    fs::read_to_string(path).map_err(|e| format!("{}: {e}", path.display()))
}
