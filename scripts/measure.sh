# shellcheck shell=bash disable=SC2034,SC2154 # what is set for, and by, the scripts that source this
# What scripts/methods.sh and scripts/single.sh share. They source it after lib.sh, and set `scenes`, `materials`,
# `plans`, `bounds` and `quick_without`.

# measure_begin FOLDER REFERENCES ARGUMENTS... : reads --quick, --fresh and --out DIR, sets the machine up, builds, and writes
# tables and facts to the work folder. Leaves `folder`, `marmor`, and `materials` and `plans` as asked for.
measure_begin() {
    folder=$1
    run='full'
    local references=$2 fresh=
    shift 2
    while [ $# -gt 0 ]; do
        case $1 in
            --quick) run='quick: marble and the main plans only' ;;
            --fresh) fresh=1 ;;
            --out)
                [ $# -gt 1 ] || { complain '--out needs a folder'; exit 2; }
                folder=$2
                shift
                ;;
            -h | --help)
                sed -n '2,/^set /s/^# \{0,1\}//p' "$0"
                exit 0
                ;;
            *)
                complain "unknown argument '$1' (known: --quick, --fresh, --out DIR)"
                exit 2
                ;;
        esac
        shift
    done
    if [ "$run" != full ]; then
        materials=marble
        plans=$(printf '%s\n' "$plans" | awk -v out="$quick_without" '$1 !~ out')
    fi

    # shellcheck disable=SC2119 # the arguments are not for the set-up
    marmor_setup
    build_marmor
    marmor=${CARGO_TARGET_DIR:-target}/release/marmor

    mkdir -p "$folder/$references"
    [ -z "${fresh:-}" ] || rm -f "$folder/$references"/*
    mkdir -p "$folder/plans" "$folder/times" "$folder/pictures"
    rm -f "$folder"/plans/*.json "$folder"/times/*.json
    python3 scripts/methods.py meshes "$folder"
    printf '%s\n' "$scenes" >"$folder/scenes.txt"
    printf '%s\n' "$materials" >"$folder/materials.txt"
    printf '%s\n' "$plans" >"$folder/plans.txt"
    printf '%s\n' "$bounds" >"$folder/bounds.txt"
    {
        printf 'run=%s\n' "$run"
        printf 'cores=%s\n' "$(getconf _NPROCESSORS_ONLN)"
        printf 'commit=%s%s\n' "$(git rev-parse --short HEAD 2>/dev/null || echo unknown)" \
            "$(git diff --quiet HEAD -- src shaders build.rs Cargo.lock 2>/dev/null || echo ', changed')"
    } >"$folder/facts.txt"
}

# The rows of a measuring script's table, without its blank lines.
rows() { printf '%s\n' "$1" | grep -v '^ *$'; }

# The mesh of a scene: a bundled one, or one of the work folder's.
mesh_of() { case $1 in *.obj) echo "$folder/$1" ;; *) echo "$1" ;; esac; }
