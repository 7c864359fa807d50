#!/bin/sh
# faceoff with dolfinx over the nodes of a cluster:  sbatch fenicsx/slurm.sh
#
# faceoff itself and its Rust engine run on the first node, dolfinx as one process a task on all of them.
#SBATCH --job-name=faceoff
#SBATCH --nodes=2
#SBATCH --ntasks-per-node=32
#SBATCH --cpus-per-task=1
#SBATCH --mem-per-cpu=3G
#SBATCH --time=01:00:00
#SBATCH --output=faceoff-%j.log
set -eu

# A Python with dolfinx, whose mpi4py and petsc4py belong to the MPI that srun starts. If they do not, the companion
# says so (each process then believes to be alone), and srun wants --mpi=pmix or what `srun --mpi=list` offers.
export FACEOFF_PYTHON="${FACEOFF_PYTHON:-$(command -v python3)}"

# Job folders and compiled forms have to be on a disk that all nodes see.
here="${SLURM_SUBMIT_DIR:-$PWD}"
export XDG_CACHE_HOME="$here/cache"

# By default MUMPS, exact to rounding: in space its memory grows as the dofs to the power 4/3. Beyond some 10^7 dofs:
# export PETSC_OPTIONS="-ksp_type gmres -ksp_rtol 1e-13 -pc_type hypre"

scene=${1:-one-zone-3d}
faceoff verify "$scene" --n "${N:-32}" --engines rust,fenicsx \
    --launcher "srun --ntasks=$SLURM_NTASKS --kill-on-bad-exit=1" \
    --keep "$here/jobs-$SLURM_JOB_ID" --resume "$here/answers" \
    --json "faceoff-$SLURM_JOB_ID.json" --report "report-$SLURM_JOB_ID"
