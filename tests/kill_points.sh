#!/usr/bin/env bash
# A replacement of a stack (`voxelize --force`) is killed, or refused, at each of its calls of the system in turn.
# After each the directory must hold the old stack or the new one whole, also after `info`, after a run, and after an
# interrupted run. Prints how many points there were and what was lost.
#
#   VOXLATHE=target/release/voxlathe tests/kill_points.sh [STEP]
#
# STEP: every how many-th call is taken, 1 by default. Needs strace. WAYS=journal runs with a foreign file in the
# directory, so that the journal does the work and not the exchange; the default is both ways.
set -u
: "${VOXLATHE:?the binary}"
scenes=${SCENES:-$(dirname "$0")/../scenes}
step=${1:-1}
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
command -v strace >/dev/null || { echo "strace is needed" >&2; exit 3; }
if ! strace -f -qq -o /dev/null true 2>/dev/null; then
    echo "skipped: processes cannot be traced here"
    exit 0
fi
flags="--threads 1 --quiet"
calls=mkdir,mkdirat,openat,write,fsync,fdatasync,rename,renameat,renameat2,unlink,unlinkat,rmdir,close,flock,chmod,fchmod,fchmodat,statx,newfstatat,getdents64,read,listxattr,access,faccessat,lstat,stat,getcwd,readlink,ftruncate,linkat
lost=0
points=0

voxelize() { "$VOXLATHE" voxelize "$scenes/$1.toml" -o "$2" --resolution "$3" $flags "${@:4}"; }

voxelize vase "$work/old" 5
voxelize goblet "$work/new" 4
# Of runs that are left to end before they are harmed.
voxelize goblet "$work/large" 90
digests() { (cd "$1" && sha256sum manifest.json slice-*.exr 2>/dev/null | sort -k 2); }
old=$(digests "$work/old")
new=$(digests "$work/new")
large=$(digests "$work/large")

# What the directory holds by itself, without a look at staged files: it may be between the two.
whole() {
    local now
    now=$(digests "$1")
    [ "$now" = "$old" ] || [ "$now" = "$new" ] || [ "$now" = "$large" ]
}

lose() { lost=$((lost + 1)); echo "LOST: $*"; }

# After a kill or a refusal: info settles what is left, then a run works, then an interrupted run harms nothing.
examine() {
    local d=$1 what=$2
    "$VOXLATHE" info "$d" >/dev/null 2>"$work/err" || lose "$what: info: $(cat "$work/err")"
    whole "$d" || lose "$what: neither stack after info"
    [ "$3" = exchange ] || [ "$(cat "$d/mine")" = mine ] || lose "$what: a foreign file"
    timeout -s INT 0.03 "$VOXLATHE" voxelize "$scenes/goblet.toml" -o "$d" --resolution 300 $flags --force 2>/dev/null
    whole "$d" || lose "$what: neither stack after an interrupted run"
    voxelize goblet "$d" 4 --force 2>"$work/err" || lose "$what: next run: $(cat "$work/err")"
    [ "$(digests "$d")" = "$new" ] || lose "$what: not the new stack after a run"
    [ "$3" = exchange ] || [ "$(cat "$d/mine")" = mine ] || lose "$what: a foreign file after a run"
    local left
    left=$(find "$(dirname "$d")" -name '.voxlathe*')
    [ -z "$left" ] || lose "$what: left: $left"
}

fresh() {
    rm -rf "$work/at"
    mkdir -p "$work/at"
    cp -r "$work/old" "$work/at/d"
    [ "$1" = exchange ] || echo mine >"$work/at/d/mine"
}

# The run with a fault; the shell's own word of its death is not of interest.
inject() {
    {
        strace -f -qq -o /dev/null -e trace="$1" -e inject="$2" \
            "$VOXLATHE" voxelize "$scenes/goblet.toml" -o "$work/at/d" --resolution 4 $flags --force
    } >/dev/null 2>&1
}

trace() { strace -f -qq -o "$work/trace" -e trace="$calls" "$@"; }

for way in ${WAYS:-exchange journal}; do
    fresh "$way"
    trace "$VOXLATHE" voxelize "$scenes/goblet.toml" -o "$work/at/d" --resolution 4 $flags --force
    # From the first that changes anything to the last, by kind of call: its name, and its number among those of its
    # kind in its thread, as faults are counted.
    awk '{ thread = $1; sub(/^[0-9]+ +/, ""); if (match($0, /^[a-z0-9_]+\(/)) {
             name = substr($0, 1, RLENGTH - 1); n[thread, name]++
             if ($0 ~ /voxlathe-staging/) started = 1
             if (started) print name, n[thread, name] } }' "$work/trace" | awk '!seen[$0]++' >"$work/points"
    total=$(wc -l <"$work/points")
    for fault in signal=SIGKILL error=EIO error=ENOSPC error=EACCES; do
        before=$points
        while read -r name number; do
            points=$((points + 1))
            [ $((points % step)) -eq 0 ] || continue
            fresh "$way"
            inject "$name" "$name:$fault:when=$number"
            examine "$work/at/d" "$way, $fault at $name $number" "$way"
        done <"$work/points"
        echo "$way, $fault: $((points - before)) points of $total, every ${step}th taken; lost so far: $lost"
    done
    renames=$(grep -c '^rename' "$work/points")
    for from in $(seq 1 "$renames"); do
        fresh "$way"
        inject rename,renameat,renameat2 "rename,renameat,renameat2:error=EACCES:when=$from+"
        examine "$work/at/d" "$way, every rename refused from $from on" "$way"
    done
    echo "$way, every rename refused from the n-th on: $renames points; lost so far: $lost"
done

# A directory that loses its write bit. The administrator may write in spite of it.
if [ "$(id -u)" -eq 0 ] && command -v setpriv >/dev/null && id nobody >/dev/null 2>&1; then
    chmod 755 "$work"
    cp "$VOXLATHE" "$work/voxlathe"
    cp -r "$scenes" "$work/scenes"
    chmod -R a+rX "$work"
    as="setpriv --reuid nobody --regid nogroup --clear-groups"
    for way in ${WAYS:-exchange journal}; do
        for moment in 0.00 0.02 0.05 0.1 0.3; do
            fresh "$way"
            chown -R nobody "$work/at"
            $as "$work/voxlathe" voxelize "$work/scenes/goblet.toml" -o "$work/at/d" --resolution 90 $flags --force >/dev/null 2>&1 &
            sleep "$moment"
            chmod a-w "$work/at/d"
            wait $!
            whole "$work/at/d" || "$VOXLATHE" info "$work/at/d" >/dev/null || lose "$way, write bit after $moment s"
            chmod u+w "$work/at/d"
            $as "$work/voxlathe" info "$work/at/d" >/dev/null || lose "$way, write bit after $moment s: info"
            examine "$work/at/d" "$way, write bit after $moment s" "$way"
        done
    done
    echo "a directory that loses its write bit; lost so far: $lost"
fi
echo "$points points, $lost lost"
[ "$lost" -eq 0 ]
