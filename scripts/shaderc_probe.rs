//! Does a libshaderc link, with every function the `shaderc` crate calls, and
//! does it turn a line of GLSL into optimised SPIR-V for Vulkan 1.3?
//! scripts/lib.sh compiles and runs this; it is not part of the crate.

use std::ffi::{c_char, c_int, c_void};
use std::hint::black_box;
use std::process::exit;
use std::ptr::null;

const COMPUTE_SHADER: c_int = 2;
const OPTIMISE_FOR_PERFORMANCE: c_int = 2;
const TARGET_VULKAN: c_int = 0;
const VULKAN_1_3: u32 = (1 << 22) | (3 << 12);
const SPIRV_MAGIC: u32 = 0x0723_0203;

unsafe extern "C" {
    fn shaderc_compiler_initialize() -> *const c_void;
    fn shaderc_compile_options_initialize() -> *const c_void;
    fn shaderc_compile_options_set_optimization_level(options: *const c_void, level: c_int);
    fn shaderc_compile_options_set_target_env(options: *const c_void, env: c_int, version: u32);
    fn shaderc_compile_into_spv(
        compiler: *const c_void,
        source: *const c_char,
        length: usize,
        kind: c_int,
        file: *const c_char,
        entry: *const c_char,
        options: *const c_void,
    ) -> *const c_void;
    fn shaderc_result_get_compilation_status(result: *const c_void) -> c_int;
    fn shaderc_result_get_length(result: *const c_void) -> usize;
    fn shaderc_result_get_bytes(result: *const c_void) -> *const c_void;
}

/// Declares functions by name alone and lists their addresses: enough to link.
macro_rules! linked {
    ($($name:ident)*) => {
        unsafe extern "C" { $(fn $name();)* }
        fn linked() -> Vec<*const ()> { vec![$($name as *const ()),*] }
    };
}

linked! {
    shaderc_assemble_into_spv
    shaderc_compile_into_preprocessed_text
    shaderc_compile_into_spv_assembly
    shaderc_compile_options_add_macro_definition
    shaderc_compile_options_clone
    shaderc_compile_options_release
    shaderc_compile_options_set_auto_bind_uniforms
    shaderc_compile_options_set_auto_combined_image_sampler
    shaderc_compile_options_set_auto_map_locations
    shaderc_compile_options_set_binding_base
    shaderc_compile_options_set_binding_base_for_stage
    shaderc_compile_options_set_forced_version_profile
    shaderc_compile_options_set_generate_debug_info
    shaderc_compile_options_set_hlsl_functionality1
    shaderc_compile_options_set_hlsl_io_mapping
    shaderc_compile_options_set_hlsl_offsets
    shaderc_compile_options_set_hlsl_register_set_and_binding
    shaderc_compile_options_set_hlsl_register_set_and_binding_for_stage
    shaderc_compile_options_set_include_callbacks
    shaderc_compile_options_set_invert_y
    shaderc_compile_options_set_limit
    shaderc_compile_options_set_nan_clamp
    shaderc_compile_options_set_source_language
    shaderc_compile_options_set_suppress_warnings
    shaderc_compile_options_set_target_spirv
    shaderc_compile_options_set_warnings_as_errors
    shaderc_compiler_release
    shaderc_get_spv_version
    shaderc_parse_version_profile
    shaderc_result_get_error_message
    shaderc_result_get_num_errors
    shaderc_result_get_num_warnings
    shaderc_result_release
}

fn main() {
    black_box(linked());
    let source = "#version 460\nlayout(local_size_x = 8) in; void main() {}\n";
    // SAFETY: the signatures are those of shaderc.h; the source is passed with
    // its length, both names end in NUL; pointers are checked before use; the
    // process ends right after, so nothing is released.
    let magic = unsafe {
        let compiler = shaderc_compiler_initialize();
        let options = shaderc_compile_options_initialize();
        if compiler == null() || options == null() {
            exit(1);
        }
        shaderc_compile_options_set_optimization_level(options, OPTIMISE_FOR_PERFORMANCE);
        shaderc_compile_options_set_target_env(options, TARGET_VULKAN, VULKAN_1_3);
        let result = shaderc_compile_into_spv(
            compiler,
            source.as_ptr().cast(),
            source.len(),
            COMPUTE_SHADER,
            c"probe".as_ptr(),
            c"main".as_ptr(),
            options,
        );
        if result == null()
            || shaderc_result_get_compilation_status(result) != 0
            || shaderc_result_get_length(result) < 20
        {
            exit(1);
        }
        shaderc_result_get_bytes(result)
            .cast::<u32>()
            .read_unaligned()
    };
    exit(if magic == SPIRV_MAGIC { 0 } else { 1 });
}
