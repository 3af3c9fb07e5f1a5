#!/usr/bin/env bash
# make.sh SIM FOLDER [SHARE]: the pictures of README.md and docs/, with sides of that share of their size.
set -euo pipefail
sim=$1 folder=$2 share=${3:-1}
mkdir -p "$folder"

# A picture of W x H pixels: picture W H ARGS...
picture() {
  local width=$(($1 / share)) height=$(($2 / share))
  shift 2
  "$sim" "$@" -q --no-verify --size "${width}x$height"
}

picture 880 495 scenes/cloth.lua -s n=40 -d 0.0015 -T 0.54 --out "$folder/cloth.png"
picture 800 450 scenes/cloth_ball.lua -s n=24 -T 1.2 --out "$folder/ball.png"
picture 800 450 scenes/drape_self.lua -s n=32 -T 0.9 --out "$folder/drape_self.png"
picture 800 450 scenes/fold.lua -s n=20 -T 2.2 --out "$folder/fold.png"
picture 800 450 scenes/twist.lua -s n=24 -T 0.7 --out "$folder/twist.png"
picture 800 450 scenes/ring.lua -T 0.7 --out "$folder/ring.png"
picture 800 450 scenes/drape_rods.lua -s n=20 -T 1.2 --out "$folder/drape_rods.png"
picture 800 450 scenes/hammock.lua -T 2 --out "$folder/hammock.png"
picture 800 450 scenes/toys.lua -T 1 --out "$folder/toys.png"
picture 800 450 scenes/chain_mail.lua -T 0.8 --out "$folder/chain_mail.png"
picture 800 450 scenes/flag.lua -T 2 --out "$folder/flag.png"
picture 800 450 scenes/boat.lua -T 0.5 --out "$folder/boat.png"
picture 800 450 scenes/cloth.lua -s n=12 -T 0.5 --springs 65 --out "$folder/springs.png"
picture 800 450 scenes/cloth.lua -s n=24 -d 0.002 -T 0.45 --wireframe --out "$folder/wireframe.png"
((share > 1)) || python3 -B "$(dirname -- "$0")/../view/picture.py" "$sim" "$folder/page.png"
((share > 1)) || "$sim" tradeoff scenes/cloth.lua --time 2 --progress off --svg "$folder/tradeoff.svg" >/dev/null
picture 800 450 scenes/cloth.lua -s n=32 -d 0.002 -T 0.36 --color strain:0.5 --out "$folder/strain.png"
"$sim" compare scenes/cloth.lua -s n=12 -T 0.7 -d 0.006 -i rk4 -i verlet -i implicit_euler --progress off \
  --color error:0.1 --size "$((1200 / share))x$((360 / share))" --out "$folder/compare.png" > /dev/null
# Three moments of each system of scenes/sample.lua.
moments() {
  local scene=$1 camera=$2 i=1
  shift 2
  for time in "$@"; do
    picture 400 225 "scenes/$scene.lua" ${more:-} -T "$time" --camera "$camera" \
      --out "$folder/$scene-$i.png"
    i=$((i + 1))
  done
}
moments circle "eye=1.7,1.2,4.6 at=0,-0.1,0" 1 2.4 5
moments pendulum "eye=2.1,0.6,5.4 at=0.15,-0.75,0" 0.35 0.8 1.3
more="-s n=20 -d 0.0025" moments cloth "eye=1.6,0.5,3.2 at=0.45,-0.55,0.1" 0.2 0.45 0.9
