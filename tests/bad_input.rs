//! The promise: bad input ends with the right code and one clear line that names the
//! file, the place and the remedy, and leaves no file behind.

mod common;

use common::program::{exr, file, folder, names, png, run};

const TRIANGLE: &str = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";

/// One case, which must end with exit code 2: its files, its arguments, and what the line
/// must hold.
struct Case {
    what: &'static str,
    files: &'static [(&'static str, &'static [u8])],
    arguments: &'static str,
    holds: &'static [&'static str],
}

const fn case(
    what: &'static str,
    files: &'static [(&'static str, &'static [u8])],
    arguments: &'static str,
    holds: &'static [&'static str],
) -> Case {
    Case {
        what,
        files,
        arguments,
        holds,
    }
}

/// Scenes and flags. In a folder of their own, they must leave only their own files.
const CASES: &[Case] = &[
    case(
        "missing scene file",
        &[],
        "render gone.toml -o out.png",
        &["gone.toml", "no such file", "check the path"],
    ),
    case(
        "a window on a missing scene file, display or not",
        &[],
        "view gone.toml",
        &["gone.toml", "no such file", "check the path"],
    ),
    case(
        "a window for minutes",
        &[],
        "view --multiple exact",
        &["exact takes minutes", "marmor render --multiple exact"],
    ),
    case(
        "a window for rays",
        &[],
        "view --single traced",
        &["traced", "marmor render", "--single 8"],
    ),
    case(
        "a window without an area",
        &[],
        "view --window 0x600",
        &["--window", "from 1 to 16384"],
    ),
    case(
        "an unknown way to present",
        &[],
        "view --present mailbocks",
        &["mailbocks", "did you mean \"mailbox\"?"],
    ),
    case(
        "an unknown size in motion",
        &[],
        "view --in-motion halb",
        &["halb", "did you mean \"half\"?"],
    ),
    case(
        "a watched folder without shaders",
        &[],
        "view --watch .",
        &["no folder of shaders", "name the folder shaders"],
    ),
    case(
        "missing mesh",
        &[],
        "render gone.obj -o out.png",
        &["gone.obj", "no such file", "check the path"],
    ),
    case(
        "a folder as a scene",
        &[],
        "render . -o out.png",
        &["neither a .toml, .obj, .gltf or .glb file", "statue"],
    ),
    case(
        "unknown bundled mesh",
        &[],
        "render statu -o out.png",
        &["statu", "did you mean \"statue\"?"],
    ),
    case(
        "empty OBJ",
        &[("a.obj", b"")],
        "render a.obj -o out.png",
        &["a.obj", "neither vertices nor faces", "export"],
    ),
    case(
        "OBJ without faces",
        &[("a.obj", b"v 0 0 0\nv 1 0 0\nv 0 1 0\n")],
        "render a.obj -o out.png",
        &["a.obj", "no faces", "export"],
    ),
    case(
        "face out of range",
        &[("a.obj", b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 9\n")],
        "render a.obj -o out.png",
        &["a.obj:4", "vertex 9, but the file has 3", "export it anew"],
    ),
    case(
        "negative face index out of range",
        &[("a.obj", b"v 0 0 0\nf -1 -2 -3\n")],
        "render a.obj -o out.png",
        &["a.obj:2", "vertex -2", "export"],
    ),
    case(
        "face index 0",
        &[("a.obj", b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 0 1 2\n")],
        "render a.obj -o out.png",
        &["a.obj:4", "counts from 1"],
    ),
    case(
        "NaN vertex",
        &[("a.obj", b"v 0 0 0\nv nan 0 0\nv 0 1 0\nf 1 2 3\n")],
        "render a.obj -o out.png",
        &["a.obj:2", "vertex 2 is not finite", "repair the mesh"],
    ),
    case(
        "infinite vertex",
        &[("a.obj", b"v 0 0 0\nv 1 0 0\nv 0 -inf 0\nf 1 2 3\n")],
        "render a.obj -o out.png",
        &["a.obj:3", "vertex 3 is not finite", "repair the mesh"],
    ),
    case(
        "vertex that is no number",
        &[("a.obj", b"v 0 0 zero\n")],
        "render a.obj -o out.png",
        &["a.obj:1", "\"zero\" is not a number"],
    ),
    case(
        "zero-area mesh",
        &[("a.obj", b"v 0 0 0\nv 1 1 1\nv 2 2 2\nf 1 2 3\nf 3 2 1\n")],
        "render a.obj -o out.png",
        &["a.obj", "no triangle has any area", "check the scale"],
    ),
    case(
        "mesh at one point",
        &[("a.obj", b"v 1 1 1\nv 1 1 1\nv 1 1 1\nf 1 2 3\n")],
        "render a.obj -o out.png",
        &["a.obj", "no triangle has any area", "check the scale"],
    ),
    case(
        "binary OBJ",
        &[("a.obj", b"v 0 0 0\n\xff\xfe\n")],
        "render a.obj -o out.png",
        &["a.obj:2", "not UTF-8", "save the file as UTF-8"],
    ),
    case(
        "mesh beyond all units",
        &[("a.obj", b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")],
        "render a.obj --unit 1e12 -o out.png",
        &["a.obj", "radius", "set unit"],
    ),
    case(
        "a method beside a budget",
        &[],
        "render --fetch-budget 9 --multiple rings -o out.png",
        &["--multiple cannot stand beside --fetch-budget", "drop one"],
    ),
    case(
        "samples beside a budget",
        &[],
        "render --fetch-budget 9 --samples 4 -o out.png",
        &["--samples cannot stand beside --fetch-budget"],
    ),
    case(
        "single scattering beside a budget",
        &[],
        "fetches --fetch-budget 9 --single off",
        &["--single cannot stand beside --fetch-budget"],
    ),
    case(
        "a split beside a budget",
        &[],
        "render --fetch-budget 9 --split brdf -o out.png",
        &["--split cannot stand beside --fetch-budget"],
    ),
    case(
        "a divider beside a budget",
        &[],
        "render --fetch-budget 9 --split-at 0.3 -o out.png",
        &["--split-at cannot stand beside --fetch-budget"],
    ),
    case(
        "a budget of nothing",
        &[],
        "render --fetch-budget 0 -o out.png",
        &["--fetch-budget", "from 1 to 1000000, not 0"],
    ),
    case(
        "a budget too small",
        &[],
        "fetches --fetch-budget 1",
        &[
            "fetch budget of 1 is too small for statue",
            "give --fetch-budget 2",
        ],
    ),
    case(
        "a method beside a budget in a file",
        &[("s.toml", b"[method]\nvolumes = 2\nfetch_budget = 9\n")],
        "render s.toml -o out.png",
        &[
            "s.toml:3",
            "fetch_budget in [method]",
            "volumes",
            "drop one",
        ],
    ),
    case(
        "a parameter beside the budget of a file",
        &[("s.toml", b"[method]\nfetch_budget = 9\n")],
        "render s.toml --single 4 -o out.png",
        &[
            "--single has no effect beside the fetch_budget of s.toml",
            "--multiple",
        ],
    ),
    case(
        "a budget in a file that is no number",
        &[("s.toml", b"[method]\nfetch_budget = \"low\"\n")],
        "render s.toml -o out.png",
        &["s.toml:2", "fetch_budget", "a whole number"],
    ),
    case(
        "unknown preset by flag",
        &[],
        "render --material marbel -o out.png",
        &["--material", "marbel", "did you mean \"marble\"?"],
    ),
    case(
        "unknown preset in a file",
        &[("s.toml", b"# a comment\nmaterial = \"ketchop\"\n")],
        "render s.toml -o out.png",
        &["s.toml:2", "ketchop", "did you mean \"ketchup\"?"],
    ),
    case(
        "negative sigma by flag",
        &[],
        "render --sigma-a -1,0,0 -o out.png",
        &["--sigma-a", "0 mm^-1 or greater", "-1"],
    ),
    case(
        "zero sigma_s by flag",
        &[],
        "render --sigma-s 1,0,1 -o out.png",
        &["--sigma-s", "greater than 0 mm^-1"],
    ),
    case(
        "negative sigma in a file",
        &[(
            "s.toml",
            b"[material]\nsigma_s = [1, 1, -2]\nsigma_a = [0, 0, 0]\n",
        )],
        "render s.toml -o out.png",
        &["s.toml:2", "sigma_s in [material]", "greater than 0", "-2"],
    ),
    case(
        "eta out of range",
        &[],
        "render --eta 0.5 -o out.png",
        &["--eta", "from 1 to 3", "0.5"],
    ),
    case(
        "size 0",
        &[],
        "render --size 0x600 -o out.png",
        &["--size", "1 to 16384", "width of 0"],
    ),
    case(
        "size 40000",
        &[],
        "render --size 800x40000 -o out.png",
        &["--size", "1 to 16384", "height of 40000"],
    ),
    case(
        "negative size",
        &[],
        "render --size -1x600 -o out.png",
        &["--size", "1 to 16384", "width of -1"],
    ),
    case(
        "size without a height",
        &[],
        "render --size 800 -o out.png",
        &["--size", "800x600"],
    ),
    case(
        "size 0 in a file",
        &[("s.toml", b"\n\nsize = [800, 0]\n")],
        "render s.toml -o out.png",
        &["s.toml:3", "size", "1 to 16384", "height of 0"],
    ),
    case(
        "output into a missing folder",
        &[],
        "render -o missing/out.png",
        &["missing/out.png", "no folder \"missing\"", "create it"],
    ),
    case(
        "output is a folder",
        &[],
        "render -o kept.png",
        &["kept.png", "is a folder", "name a file in it"],
    ),
    case(
        "output with another extension",
        &[],
        "render -o out.jpg",
        &["out.jpg", ".png", ".exr"],
    ),
    case(
        "output without an extension",
        &[],
        "render -o out",
        &["out", ".png", ".exr"],
    ),
    case(
        "no output",
        &[],
        "render",
        &["--output", "marmor render --help"],
    ),
    case(
        "stats into a missing folder",
        &[],
        "render -o out.png --stats missing/s.json",
        &["missing/s.json", "create it"],
    ),
    case(
        "stats over the picture",
        &[],
        "render -o out.png --stats out.png",
        &["out.png", "same file", "different names"],
    ),
    case(
        "misspelt key",
        &[(
            "s.toml",
            b"mesh = \"statue\"\n[light]\nelevation = 3\nazimut = 40\n",
        )],
        "render s.toml -o out.png",
        &[
            "s.toml:4",
            "unknown key \"azimut\" in [light]",
            "did you mean \"azimuth\"?",
        ],
    ),
    case(
        "misspelt table",
        &[("s.toml", b"[camara]\nfov = 30\n")],
        "render s.toml -o out.png",
        &["s.toml:1", "camara", "did you mean \"camera\"?"],
    ),
    case(
        "key under the wrong table",
        &[("s.toml", b"[light]\nexposure = 2\n")],
        "render s.toml -o out.png",
        &["s.toml:2", "exposure", "above the first [table]"],
    ),
    case(
        "bad type",
        &[("s.toml", b"[light]\nazimuth = \"left\"\n")],
        "render s.toml -o out.png",
        &[
            "s.toml:2",
            "azimuth in [light] must be a number, not \"left\"",
        ],
    ),
    case(
        "not TOML",
        &[("s.toml", b"mesh = \"statue\"\nlight {\n")],
        "render s.toml -o out.png",
        &["s.toml:2", "not valid TOML"],
    ),
    case(
        "scene that names a missing mesh",
        &[("s.toml", b"mesh = \"gone.obj\"\n")],
        "render s.toml -o out.png",
        &["s.toml:1", "gone.obj", "relative to the scene file"],
    ),
    case(
        "bad method by flag",
        &[],
        "render --multiple sample -o out.png",
        &["--multiple", "sample", "did you mean \"samples\"?"],
    ),
    case(
        "bad method in a file",
        &[("s.toml", b"[method]\nmultiple = \"magic\"\n")],
        "render s.toml -o out.png",
        &[
            "s.toml:2",
            "magic",
            "none, brdf, samples, rings, mixture, exact",
        ],
    ),
    case(
        "bad split",
        &[],
        "render --split diff -o out.png",
        &["--split", "diff", "brdf"],
    ),
    case(
        "a divider beyond the picture",
        &[],
        "render --split brdf --split-at 1.01 -o out.png",
        &["--split-at", "from 0 to 1, not 1.01"],
    ),
    case(
        "a divider before the picture",
        &[],
        "render --split brdf --split-at -0.5 -o out.png",
        &["--split-at", "from 0 to 1, not -0.5"],
    ),
    case(
        "a divider that is no number",
        &[],
        "render --split brdf --split-at nan -o out.png",
        &["--split-at", "from 0 to 1, not NaN"],
    ),
    case(
        "a divider of nothing",
        &[],
        "render --split-at 0.3 -o out.png",
        &["--split-at has no effect", "drop it, or add --split"],
    ),
    case(
        "a divider beyond the picture in a scene",
        &[("s.toml", b"[method]\nsplit = \"brdf\"\nsplit_at = -1\n")],
        "render s.toml -o out.png",
        &["s.toml:3", "split_at in [method]", "from 0 to 1, not -1"],
    ),
    case(
        "a background of two channels",
        &[("s.toml", b"background = [0, 1]\n")],
        "render s.toml -o out.png",
        &["s.toml:1", "background", "3 numbers, not an array of 2"],
    ),
    case(
        "a colour that is neither on nor off",
        &[(
            "s.toml",
            b"[material]\npreset = \"skin1\"\ncolored_by_mesh = \"yes\"\n",
        )],
        "render s.toml -o out.png",
        &["s.toml:3", "colored_by_mesh in [material]", "true or false"],
    ),
    case(
        "samples out of range",
        &[],
        "render --samples 257 -o out.png",
        &["--samples", "1 to 256", "257"],
    ),
    case(
        "samples without effect",
        &[],
        "render --samples 8 --multiple exact -o out.png",
        &["--samples", "no effect", "drop it"],
    ),
    case(
        "rings out of range",
        &[],
        "render --multiple rings --rings 0 -o out.png",
        &["--rings", "1 to 14", "0"],
    ),
    case(
        "moments out of range",
        &[],
        "render --multiple mixture --moments 5 -o out.png",
        &["--moments", "3 to 4", "5"],
    ),
    case(
        "moments without effect",
        &[],
        "render --moments 4 -o out.png",
        &["--moments", "no effect", "--multiple mixture"],
    ),
    case(
        "a level for a fourth moment that is not read",
        &[],
        "render --multiple mixture --fourth-from 2 -o out.png",
        &["--fourth-from", "no effect", "--moments 4"],
    ),
    case(
        "two choices of levels for the fourth moment",
        &[],
        "render --multiple mixture --moments 4 --fourth-from 2 --fourth-levels 3 -o out.png",
        &["--fourth-from", "--fourth-levels"],
    ),
    case(
        "unknown weights",
        &[],
        "render --multiple mixture --weights closd -o out.png",
        &["--weights", "closd", "did you mean \"closed\"?"],
    ),
    case(
        "a step of levels in a file",
        &[(
            "s.toml",
            b"[method]\nmultiple = \"mixture\"\nlevel_step = 3\n",
        )],
        "render s.toml -o out.png",
        &["s.toml:3", "level_step", "1 to 2", "3"],
    ),
    case(
        "volumes out of range",
        &[],
        "render --multiple mixture --volumes 9 -o out.png",
        &["--volumes", "0 to 8", "9"],
    ),
    case(
        "volumes without effect",
        &[],
        "render --multiple rings --volumes 3 -o out.png",
        &["--volumes", "no effect", "--multiple mixture"],
    ),
    case(
        "volumes in a file",
        &[(
            "s.toml",
            b"[method]\nmultiple = \"mixture\"\nvolumes = -1\n",
        )],
        "render s.toml -o out.png",
        &["s.toml:3", "volumes", "0 to 8", "-1"],
    ),
    case(
        "unknown weights in a file",
        &[("s.toml", b"[method]\nweights = \"magic\"\n")],
        "render s.toml -o out.png",
        &["s.toml:2", "magic", "closed, fitted, best"],
    ),
    case(
        "too few steps of single scattering",
        &[],
        "render --single 0 -o out.png",
        &["--single", "1 to 64", "0"],
    ),
    case(
        "single scattering that is no number",
        &[],
        "render --single on -o out.png",
        &["--single", "off, traced or a whole number", "on"],
    ),
    case(
        "single scattering without transport",
        &[],
        "render --multiple brdf --single 8 -o out.png",
        &["--single", "no effect", "brdf", "--multiple none"],
    ),
    case(
        "half size of the reference",
        &[],
        "render --multiple exact --scattering half -o out.png",
        &["scattering half", "exact", "reference", "--scattering full"],
    ),
    case(
        "half size without transport",
        &[],
        "render --multiple brdf --single off --scattering half -o out.png",
        &["scattering half", "no effect", "brdf", "--scattering full"],
    ),
    case(
        "half size of a split picture",
        &[],
        "render --multiple mixture --split samples --scattering half -o out.png",
        &["scattering half", "split", "--scattering full"],
    ),
    case(
        "half size of rays",
        &[],
        "render --multiple mixture --single traced --scattering half -o out.png",
        &["scattering half", "traced", "--scattering full"],
    ),
    case(
        "half size of nothing",
        &[],
        "render --multiple none --single off --scattering half -o out.png",
        &["scattering half", "nothing to shade", "--single 8"],
    ),
    case(
        "unknown size of scattering",
        &[],
        "render --scattering hafl -o out.png",
        &["--scattering", "did you mean \"half\"?"],
    ),
    case(
        "unknown size of scattering in a file",
        &[("s.toml", b"[method]\nscattering = \"quarter\"\n")],
        "render s.toml -o out.png",
        &["s.toml:2", "quarter", "full, half"],
    ),
    case(
        "exits without a march",
        &[],
        "render --single off --exits nearest -o out.png",
        &["--exits", "no effect", "--single off"],
    ),
    case(
        "phase function without single scattering",
        &[],
        "render --g 0.5 --single off -o out.png",
        &["--g", "no effect", "--single 8"],
    ),
    case(
        "unknown exits",
        &[],
        "render --exits linaer -o out.png",
        &["--exits", "linaer", "did you mean", "linear"],
    ),
    case(
        "phase function out of range",
        &[],
        "render --g 1 -o out.png",
        &["--g", "-0.95 to 0.95", "1"],
    ),
    case(
        "too many steps in a file",
        &[("s.toml", b"[method]\nsingle = 65\n")],
        "render s.toml -o out.png",
        &["s.toml:2", "single", "1 to 64", "65"],
    ),
    case(
        "single scattering of a wrong type in a file",
        &[("s.toml", b"[method]\nsingle = true\n")],
        "render s.toml -o out.png",
        &["s.toml:2", "single", "\"off\" or \"traced\"", "true"],
    ),
    case(
        "unknown exits in a file",
        &[("s.toml", b"[method]\nexits = \"far\"\n")],
        "render s.toml -o out.png",
        &["s.toml:2", "exits", "linear, nearest, depth"],
    ),
    case(
        "phase function out of range in a file",
        &[("s.toml", b"[material]\ng = 2\n")],
        "render s.toml -o out.png",
        &["s.toml:2", "g", "-0.95 to 0.95", "2"],
    ),
    case(
        "light map out of range",
        &[],
        "render --light-map 15 -o out.png",
        &["--light-map", "16 to 8192", "15"],
    ),
    case(
        "bad light",
        &[],
        "render --light sun -o out.png",
        &["--light", "\"sun\" is not a number"],
    ),
    case(
        "light with one angle",
        &[],
        "render --light 140 -o out.png",
        &["--light", "AZIMUTH,ELEVATION", "140,25"],
    ),
    case(
        "light above the zenith",
        &[],
        "render --light 0,91 -o out.png",
        &["--light", "elevation", "-90 to 90"],
    ),
    case(
        "camera at no distance",
        &[],
        "render --camera 0,0,0 -o out.png",
        &["--camera", "distance", "greater than 0"],
    ),
    case(
        "bad background",
        &[],
        "render --background white -o out.png",
        &["--background", "#rrggbb"],
    ),
    case(
        "bad switch",
        &[],
        "render --specular yes -o out.png",
        &["--specular", "on or off"],
    ),
    case(
        "bad jitter",
        &[],
        "render --jitter sample -o out.png",
        &["--jitter", "did you mean \"samples\"?"],
    ),
    case(
        "misspelt flag",
        &[],
        "render --siz 8x8 -o out.png",
        &["--siz", "--size", "marmor render --help"],
    ),
    case(
        "misspelt command",
        &[],
        "rendr -o out.png",
        &["rendr", "render"],
    ),
    case(
        "memory limit of nothing",
        &[],
        "--memory-limit 0 devices",
        &["--memory-limit", "at least 1"],
    ),
    case(
        "compare with a missing picture",
        &[],
        "compare gone.png gone.png",
        &["gone.png", "no such file", "check the path"],
    ),
    case(
        "compare with another kind of file",
        &[("a.txt", b"hello")],
        "compare a.txt a.txt",
        &["a.txt", ".png", ".exr"],
    ),
    case(
        "compare with text that calls itself PNG",
        &[("a.png", b"hello")],
        "compare a.png a.png",
        &["a.png", "not a usable PNG", "write it anew"],
    ),
    case(
        "compare with text that calls itself EXR",
        &[("a.exr", b"hello")],
        "compare a.exr a.exr",
        &["a.exr", "not a usable EXR", "write it anew"],
    ),
    case(
        "bad bound",
        &[],
        "compare a.png b.png --max-rr -1",
        &["--max-rr", "0 or greater"],
    ),
    case(
        "map as EXR",
        &[],
        "compare a.png b.png --map map.exr",
        &["map.exr", "name a .png file"],
    ),
    case(
        "manual into a missing folder",
        &[],
        "man --out missing",
        &["missing", "create it"],
    ),
    case(
        "bench of no map",
        &[],
        "bench reduce --light-map 0",
        &["--light-map", "16 to 8192", "0"],
    ),
    case(
        "bench of a map too large",
        &[],
        "bench reduce --light-map 1000000",
        &["--light-map", "16 to 8192", "1000000"],
    ),
    case(
        "bench of a map that is no number",
        &[],
        "bench reduce --light-map wide",
        &[
            "--light-map",
            "not a whole number",
            "marmor bench reduce --help",
        ],
    ),
    case(
        "bench of no rounds",
        &[],
        "bench reduce --rounds 0",
        &["--rounds", "1 to 10000"],
    ),
    case(
        "bench of too many rounds",
        &[],
        "bench reduce --rounds 1000000",
        &["--rounds", "1 to 10000", "1000000"],
    ),
    case(
        "bench of rounds that are no number",
        &[],
        "bench reduce --rounds many",
        &["--rounds", "not a whole number"],
    ),
    case(
        "bench into a missing folder",
        &[],
        "bench reduce --json missing/t.json",
        &["missing/t.json", "create it"],
    ),
    case("unknown bench", &[], "bench reduc", &["reduc", "no scene"]),
    case("unknown shell", &[], "completions tcsh", &["tcsh", "bash"]),
];

fn check(what: &str, ran: &common::program::Ran, code: i32, holds: &[&str]) {
    let stderr = &ran.stderr;
    assert_eq!(ran.code, code, "{what}: {stderr}");
    assert_eq!(stderr.lines().count(), 1, "{what}: {stderr}");
    assert_eq!(ran.stdout, "", "{what}");
    assert!(stderr.starts_with("marmor: "), "{what}: {stderr}");
    for fragment in holds {
        assert!(
            stderr.contains(fragment),
            "{what}: {fragment} not in {stderr}"
        );
    }
}

#[test]
fn every_fault_is_one_clear_line_and_leaves_nothing() {
    for case in CASES {
        let folder = folder();
        std::fs::create_dir(folder.path().join("kept.png")).expect("a folder");
        for (name, content) in case.files {
            file(folder.path(), name, content);
        }
        let before = names(folder.path());
        let arguments: Vec<&str> = case.arguments.split(' ').collect();
        let ran = run(folder.path(), &arguments);
        check(case.what, &ran, 2, case.holds);
        assert_eq!(names(folder.path()), before, "{}", case.what);
        assert_eq!(
            names(&folder.path().join("kept.png")).len(),
            0,
            "{}",
            case.what
        );
    }
}

#[test]
fn an_unknown_device_ends_with_code_3() {
    for arguments in [
        &["devices"][..],
        &["render", "-o", "out.png"],
        &["bench", "reduce"],
    ] {
        let folder = folder();
        let mut all = vec!["--device", "no-such-device"];
        all.extend(arguments);
        let ran = run(folder.path(), &all);
        check("unknown device", &ran, 3, &[]);
        assert_eq!(names(folder.path()).len(), 0);
    }
}

#[test]
fn pictures_of_different_sizes_are_refused_by_name() {
    let folder = folder();
    png(folder.path(), "a.png", [4, 3], |_, _| [255; 4]);
    exr(folder.path(), "b.exr", [3, 4], |_, _| [1.0; 4]);
    let ran = run(
        folder.path(),
        &["compare", "a.png", "b.exr", "--map", "m.png"],
    );
    check(
        "sizes",
        &ran,
        2,
        &["a.png is 4x3", "b.exr is 3x4", "--size"],
    );
    assert_eq!(names(folder.path()), ["a.png", "b.exr"]);
}

#[test]
fn a_value_that_is_not_finite_is_refused_by_pixel() {
    let folder = folder();
    exr(folder.path(), "a.exr", [4, 3], |_, _| [1.0; 4]);
    exr(folder.path(), "b.exr", [4, 3], |x, y| {
        [
            1.0,
            1.0,
            if (x, y) == (2, 1) { f32::INFINITY } else { 1.0 },
            1.0,
        ]
    });
    let ran = run(folder.path(), &["compare", "a.exr", "b.exr"]);
    check(
        "infinity",
        &ran,
        2,
        &["b.exr", "blue of pixel (2, 1) is inf"],
    );
}

#[test]
fn a_cut_picture_is_refused() {
    let folder = folder();
    png(folder.path(), "a.png", [64, 64], |x, y| {
        [x as u8, y as u8, 9, 255]
    });
    let whole = std::fs::read(folder.path().join("a.png")).expect("read");
    file(folder.path(), "b.png", &whole[..whole.len() / 2]);
    let ran = run(folder.path(), &["compare", "a.png", "b.png"]);
    check("cut", &ran, 2, &["b.png", "not a usable PNG"]);
}

#[test]
fn a_reference_that_covers_nothing_is_refused() {
    let folder = folder();
    exr(folder.path(), "a.exr", [4, 3], |_, _| [0.0; 4]);
    let ran = run(folder.path(), &["compare", "a.exr", "a.exr"]);
    check(
        "uncovered",
        &ran,
        2,
        &["a.exr", "no pixel is fully covered", "alpha"],
    );
}

#[test]
fn a_fault_keeps_the_picture_that_was_there() {
    let folder = folder();
    file(folder.path(), "out.png", "precious");
    let obj = format!("{TRIANGLE}f 1 2 4\n");
    file(folder.path(), "a.obj", obj);
    let ran = run(folder.path(), &["render", "a.obj", "-o", "out.png"]);
    check("kept", &ran, 2, &["a.obj:4"]);
    let kept = std::fs::read_to_string(folder.path().join("out.png")).expect("read");
    assert_eq!(kept, "precious");
}

#[cfg(unix)]
#[test]
fn a_folder_without_write_permission_is_refused() {
    use std::os::unix::fs::PermissionsExt;
    let folder = folder();
    let locked = folder.path().join("locked");
    std::fs::create_dir(&locked).expect("a folder");
    let mode = |mode| std::fs::set_permissions(&locked, std::fs::Permissions::from_mode(mode));
    mode(0o555).expect("locked");
    // The superuser may write anywhere, so there is nothing to see as root.
    if std::fs::write(locked.join("probe"), "").is_err() {
        let ran = run(folder.path(), &["render", "-o", "locked/out.png"]);
        check(
            "locked",
            &ran,
            2,
            &["locked/out.png", "cannot write to the folder"],
        );
    }
    mode(0o755).expect("unlocked");
}

#[cfg(unix)]
#[test]
fn the_device_file_is_no_output() {
    let folder = folder();
    std::os::unix::fs::symlink("/dev/null", folder.path().join("out.png")).expect("a link");
    let ran = run(folder.path(), &["render", "-o", "out.png"]);
    check("device", &ran, 2, &["out.png", "not a regular file"]);
}
