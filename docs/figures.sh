#!/bin/sh
# Writes docs/figures, the tables of `cargo rig bench` and the pictures of runs again: two hours on two cores,
# most of it the campaign on the emulated board and the comparison. Names of figures as
# arguments write those alone.
set -eu
cd "$(dirname "$0")/.."
figures=docs/figures
write() {
    name=$1
    shift
    case " $wanted " in *" $name "* | "  ") ;; *) return 0 ;; esac
    cargo rig "$@" --json > "$figures/$name.json.part"
    mv "$figures/$name.json.part" "$figures/$name.json"
}
wanted=$*
write deploy deploy --out target/figures/deploy
# Pictures of runs: a crossing, and three strategies with less friction than nominal, the steps
# 60 mm apart. The constant preload does not climb there, so that its run ends with 1.
case " $wanted " in *" picture "* | "  ")
    for controller in constant scheduled limit; do
        cargo rig deploy --set plant.mu=0.8 --controller $controller --set rig.travel_mm=180 \
            --set 'rig.step_positions_mm=[20,80,140]' --out target/figures/$controller || true
    done
    cargo rig report target/figures/constant/log.mcap target/figures/scheduled/log.mcap \
        target/figures/limit/log.mcap --picture docs/deployment.svg
    cargo rig deploy --out target/figures/nominal
    cargo rig report target/figures/nominal/log.mcap --animation docs/crossing_run.svg
    ;;
esac
write retract deploy --retract --no-files
write montecarlo montecarlo -n 1000 --seed 31000000
write montecarlo-retract montecarlo -n 1000 --retract --seed 31010000
write compare compare -n 200
write envelope envelope --out target/figures
[ ! -f target/figures/envelope.svg ] || cp target/figures/envelope.svg docs/envelope.svg
write faults-sil faults -n 100
write faults-board faults --target board -n 1
case " $wanted " in *" paper "* | "  ") cargo rig paper > /dev/null ;; esac
case " $wanted " in *" bench "* | "  ") cargo rig bench --docs > /dev/null ;; esac
