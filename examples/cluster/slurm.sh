#!/bin/bash
# Encodes a sequence with Slurm: a job for the plan, an array with a task for each shard, a job that joins them.
#
#   FRAMES=/data/talk OUT=/data/talk.gss SHARDS=64 bash slurm.sh --quality high --gop 32
#
# FRAMES, OUT and SCRATCH are seen by all nodes; the options of encode follow. A task whose node is lost is queued again by Slurm
# (--requeue). After a task that failed, run the same command again: shards that are there are kept.
#SBATCH --job-name=splatstream
#SBATCH --cpus-per-task=8
#SBATCH --mem=8G
#SBATCH --time=04:00:00
#SBATCH --requeue
set -euo pipefail

: "${FRAMES:?a folder of frames}" "${OUT:?the stream to write}" "${SHARDS:?the number of shards}"
SCRATCH=${SCRATCH:-$OUT.shards}
export FRAMES OUT SHARDS SCRATCH
options=("$@")
# Jobs that wait for one that has failed would wait for ever.
after=(--kill-on-invalid-dep=yes --export=ALL)

case ${STEP:-submit} in
submit)
    mkdir -p "$SCRATCH"
    plan=$(STEP=plan sbatch --parsable --export=ALL "$0" "${options[@]}")
    array=$(STEP=shard sbatch --parsable "${after[@]}" --dependency="afterok:$plan" --array="1-$SHARDS" "$0" "${options[@]}")
    join=$(STEP=join sbatch --parsable "${after[@]}" --dependency="afterok:$array" --cpus-per-task=1 "$0")
    echo "plan $plan, shards $array, $OUT after $join"
    ;;
plan)
    splatstream encode "$FRAMES" --write-plan -o "$SCRATCH/new-plan.json" --threads "$SLURM_CPUS_PER_TASK" "${options[@]}"
    # The same frames and options give the same plan: shards that are younger than it stay good.
    cmp -s "$SCRATCH/new-plan.json" "$SCRATCH/plan.json" || mv "$SCRATCH/new-plan.json" "$SCRATCH/plan.json"
    ;;
shard)
    number=$SLURM_ARRAY_TASK_ID shard=$SCRATCH/shard-$number-of-$SHARDS.gss
    # A shard has its name once it is whole; one of an earlier plan is older than this plan.
    if [ "$shard" -nt "$SCRATCH/plan.json" ]; then
        exit 0
    fi
    splatstream encode "$FRAMES" --plan "$SCRATCH/plan.json" --shard "$number/$SHARDS" -o "$shard" \
        --threads "$SLURM_CPUS_PER_TASK" "${options[@]}"
    ;;
join)
    splatstream concat "$SCRATCH"/shard-*-of-"$SHARDS".gss -o "$OUT"
    ;;
esac
