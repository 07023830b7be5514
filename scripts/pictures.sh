#!/usr/bin/env bash
# Makes all pictures of README.md and docs/ anew, or those named: scripts/pictures.sh scenes depth. Needs `make env vulkan`; half an
# hour on two cores, most of it for `validation`. AIRLIGHT and PYTHON choose another command and interpreter.
set -euo pipefail
cd "$(dirname "$0")/.."
airlight=${AIRLIGHT:-.venv/bin/airlight}
python=${PYTHON:-.venv/bin/python}
to=docs/pictures
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

render() { $airlight render "$@" -y; }
put() { $python scripts/pictures.py "$@"; }

photographs() { # README.md, docs/photographs.md
    for name in night-light-frames hill-sunset tea-gardens-mist; do
        $airlight image examples/photos/$name.jpg -o $to/$name.jpg -y
    done
    $airlight image examples/photos/dandelions.jpg --candidates "$work/candidates.png" -y
    put jpeg $to/candidates.jpg 1 "$work/candidates.png"
    put looks $to/looks.jpg examples/photos/*.jpg
}

comparison() { # docs/comparison.md
    $airlight compare examples/photos/casa-mila.jpg -o $to/compare-casa-mila.jpg --runs 9 \
        --variant method=epipolar,quality=draft --variant method=epipolar,quality=normal \
        --variant method=radial,samples=150 --variant vesper -y
}

viewer() {
    $airlight view table --screenshot $to/viewer.jpg -y
    $airlight view examples/photos/casa-mila.jpg --screenshot $to/viewer-photo.jpg -y
}

fog() { # docs/world.md
    render flying --time 20.2 --method march --quality final --fog exponential --fog-base 2 --fog-depth 4 --sigma-t 0.06 -o "$work/fog.png"
    put jpeg $to/fog.jpg 1 "$work/fog.png"
}

air() { # docs/fog.md
    render valley --quality final -o "$work/valley.png"
    render slats --volume "examples/volumes/smoke.npz;bounds=-1.75,0,-1.8,0.05,2.9,0" --sigma-t 20 --albedo 0.97 --air 0.004 \
        --anisotropy 0.3 --eye=-1.5,0.9,4.6 --target=-0.2,1.35,-1 --fov 32 --quality final -o "$work/smoke.png"
    put jpeg $to/valley.jpg 1 "$work/valley.png"
    put jpeg $to/smoke.jpg 1 "$work/smoke.png"
    $airlight view valley --screenshot $to/fog-viewer.jpg -y
    put points "$work/fire.npz" fog.md
    local small=(valley --width 426 --height 240)
    render "${small[@]}" --noise-amount 5 --noise-size 25 --time 4 -o "$work/kind.1.png"
    render "${small[@]}" --fog none --noise-amount 0 --air 0 --basin-level 5 -o "$work/kind.2.png"
    render "${small[@]}" --particles "$work/fire.npz" --air 1 -o "$work/kind.3.png"
    render "${small[@]}" --sun-extinction none -o "$work/kind.4.png"
    put jpeg $to/fog-kinds.jpg 2 "$work"/kind.?.png
}

glass() { # docs/world.md
    $python scripts/glass_room.py "$work/glass-room.glb"
    render "$work/glass-room.glb" --method march --quality final --sigma-t 0.12 --albedo 0.95 --anisotropy 0.35 --max-distance 15 \
        --width 960 -o "$work/glass.png"
    put jpeg $to/glass.jpg 1 "$work/glass.png"
    render stained --quality final --width 960 -o "$work/stained.png"
    put jpeg $to/stained.jpg 1 "$work/stained.png"
}

lights() { # README.md, docs/lights.md
    local name
    for name in matinee chapel; do
        render $name -o "$work/$name.png"
        put jpeg $to/$name.jpg 1 "$work/$name.png"
    done
    render slats --method march --quality final --eye=1.9,1.3,4.1 --target=-0.4,1.5,-1 --fov 46 --width 800 -o "$work/projector.png" \
        --projector "2.75,2.6,3.6;target=-0.9,1.3,-2.5;fov=24,40;intensity=800,800,800;cookie=examples/cookies/window.png"
    put jpeg $to/projector.jpg 1 "$work/projector.png"
    for more in "" "--cookie examples/cookies/leaves.png"; do
        # shellcheck disable=SC2086
        $airlight image examples/photos/dark-room-opening.jpg --look classic $more -o "$work/leaves${#more}.png" -y
    done
    put jpeg $to/leaves.jpg 2 "$work/leaves0.png" "$work"/leaves[1-9]*.png
}

scenes() { # README.md
    render table -o "$work/table.png"
    render flying --time 20.2 -o "$work/flying.png"
    put jpeg $to/table.jpg 1 "$work/table.png"
    put jpeg $to/flying.jpg 1 "$work/flying.png"
}

daylight() { # README.md, docs/daylight.md
    local sun
    for sun in 5,3 60,50 5,-4; do
        render valley --daylight air --visibility 30 --sigma-t 0.02 --sun $sun --width 640 --height 480 -o "$work/daylight$sun.png"
    done
    put jpeg $to/daylight-valley.jpg 3 "$work"/daylight5,3.png "$work"/daylight60,50.png "$work"/daylight5,-4.png
    $airlight image examples/photos/hill-sunset.jpg -o $to/daylight-hill.jpg --daylight air --depth examples/depths/hill-sunset.exr \
        --fov 50 --light 0.497,0.42 --sun-elevation 6 --altitude 900 --visibility 10 --sun-strength 4 -y
}

models() { # of daylight, docs/daylight.md: a photograph's sky drawn anew, by each of a sun at 4 degrees, then at 45
    put small "$work/hill.png" 4 examples/photos/hill-sunset.jpg
    put small "$work/hill.exr" 4 examples/depths/hill-sunset.exr
    local sun strength model k=0
    while read -r sun strength; do
        for model in "" "--multiple none" "--wavelengths rgb" "hoffman-preetham"; do
            case $model in
            hoffman-preetham) model="--daylight $model" ;;
            *) model="--daylight air --visibility 40 --sun-strength $strength $model" ;;
            esac
            # shellcheck disable=SC2086
            $airlight image "$work/hill.png" -o "$work/model.$((k += 1)).png" $model --depth "$work/hill.exr" --fov 50 --sun 300,$sun \
                --heading 340 --pitch 1 --altitude 900 --sky replace -y </dev/null
        done
    done <<<$'4 12\n45 6'
    put jpeg $to/daylight-models.jpg 4 "$work"/model.?.png
}

animation() { # docs/rendering.md
    render flying --time 17 --frames 1-84 --fps 12 --width 480 -o "$work/flying.####.png"
    put webp $to/flying.webp 12 "$work"/flying.????.png
}

guide() { # docs/scenes.md
    put guide $to/guide.jpg scenes.md
    put guide $to/guide-fog.jpg scenes.md scenes.md
}

world() { # docs/world.md
    put guide $to/world.jpg world.md
    render flying --method article --time 20.2 --width 640 -o "$work/article.1.png"
    render flying --method article-prose --time 20.2 --width 640 --article-share prose --article-steps 500 --article-cap 0.3 --cascades 4 \
        -o "$work/article.2.png"
    put jpeg $to/article.jpg 2 "$work"/article.*.png
}

validation() { $python scripts/validation_pages.py; } # docs/validation/, and ways.jpg of docs/world.md; with the figures beside them

vesper() { # docs/scenes.md
    render table --preset vesper-scene --eye 0.6,3.1,3.2 --target 0,2.6,-2 --width 640 -o "$work/vesper.1.png"
    render table --preset vesper-scene --eye 0.6,3.1,3.2 --target 0,2.6,-2 --width 640 --exposure 0.004 -o "$work/vesper.2.png"
    put jpeg $to/vesper-scene.jpg 2 "$work"/vesper.?.png
}

three() { # NAME SCENE OPTION VALUE VALUE VALUE ...: one scene with three values of an option, side by side
    local name=$1 scene=$2 option=$3 values=("$4" "$5" "$6") k
    shift 6
    for k in 0 1 2; do
        render "$scene" --method march --width 320 --height 180 "$option" "${values[k]}" "$@" -o "$work/$name.$k.png"
    done
    put jpeg $to/$name.jpg 3 "$work/$name".?.png
}

hx() { # docs/hx.md
    local bay=(flying --time 20.2)
    render "${bay[@]}" --preset hx --width 640 -o "$work/hx.png"
    put jpeg $to/hx.jpg 1 "$work/hx.png"
    three hx-density flying --sigma-t 0.0015 0.006 0.024 --time 20.2
    three hx-mie foliage-view --anisotropy 0 0.4 0.8
    three hx-ambient flying --ambient 0 0.1 0.3,0.4,0.6 --time 20.2 --sigma-t 0.006
    three hx-extinction flying --extinction-share 1 0.5 0 --time 20.2 --sigma-t 0.006
    three hx-glow flying --sun-glow 0 0.03 0.1 --time 20.2 --sigma-t 0.006 --sun-glow-size 5
    three hx-light cage --light "0,2,0;extinction=0.2" "0,2,0" "0,2,0;extinction=2"
    three hx-fog flying --fog none linear exponential --time 20.2 --sigma-t 0.03 --fog-base 0 --fog-depth 5
    three hx-noise slats --noise-amount 0 3 6 --noise-size 1.5 --steps exact
    three hx-steps slats --steps 4 16 exact --resolution 0.25
    three hx-distance flying --sun-distance 20 60 140 --time 20.2 --sigma-t 0.006
    three hx-soften slats --soften 0 2 4 --resolution 0.25 --steps 6
    three hx-filter slats --shadow-filter nearest pcf variance --shadow-size 96 --resolution 1 --steps 96
    three hx-depth foliage-view --depth-sharpness 0 4 24 --resolution 0.125 --anisotropy 0.6 --depth-threshold 10
}

slices() { # docs/slices.md
    $python scripts/slices_pictures.py "$work/slices"
    local name
    for name in falloff cookies planes earlier; do put jpeg $to/slices-$name.jpg 2 "$work/slices/$name".?.png; done
    for name in shadows noise mask; do put jpeg $to/slices-$name.jpg 2 "$work/slices/$name".?.png; done
    put jpeg $to/slices-medium.jpg 3 "$work/slices"/medium.?.png
}

depth() { # this and the rest: docs/caveats.md
    render flying --time 9 --width 640 -o "$work/depth.1.png"
    render flying --time 9 --width 640 --depth-aware 150 -o "$work/depth.2.png"
    put jpeg $to/caveat-depth.jpg 2 "$work"/depth.?.png
}

border() { put border $to/caveat-border.jpg; }

turning() {
    for degrees in 000 025 045 065 085 100; do
        render flying --time 20.2 --eye 12,9,106 --target "$(put turned $degrees)" --fov 45 --width 426 --height 240 \
            -o "$work/turning.$degrees.png"
    done
    put jpeg $to/caveat-turning.jpg 3 "$work"/turning.*.png
    put behind $to/caveat-behind.jpg
}

streaks() { put streaks $to/caveat-streaks.jpg; }

adaptation() {
    for adapt in 0 1; do
        for exposure in 0.5 1.5 5; do
            render flying --time 11 --width 426 --height 240 --exposure $exposure --adapt $adapt -o "$work/adapt.$adapt.$exposure.png"
        done
    done
    put jpeg $to/caveat-adaptation.jpg 3 "$work"/adapt.*.png
}

all=(photographs comparison viewer air fog glass lights scenes daylight models animation guide world validation vesper hx slices depth border turning streaks adaptation)
[ $# -gt 0 ] || set -- "${all[@]}"
for what in "$@"; do
    [[ " ${all[*]} " == *" $what "* ]] || { echo "there is no $what; there is ${all[*]}" >&2; exit 2; }
    "$what"
done
