//! The arguments of `mesh`.

use std::path::PathBuf;

use clap::{Args, Subcommand};

use super::{Output, Trust, Verdicts, formats};
use faceoff_mesh::io::native_names;

#[derive(Args)]
#[command(after_help = formats())]
pub(in crate::cli) struct Mesh {
    #[command(subcommand)]
    pub action: MeshAction,
}

#[derive(Subcommand)]
pub(in crate::cli) enum MeshAction {
    /// Show format, counts, bounding box, groups, times, and the fields with their ranges
    ///
    /// Also reads lists (.pvd, .pvtu), numbered files ('u_*.vtu') and Medit's .sol.
    #[command(after_help = formats())]
    Info {
        file: PathBuf,
        /// The mesh of a .sol, instead of the one next to it
        #[arg(long, value_name = "FILE")]
        mesh: Option<PathBuf>,
        #[command(flatten)]
        output: Output,
    },
    /// Find inverted, degenerate and duplicate cells, orphan points, hanging nodes and more
    ///
    /// Exit code: 0 sound, 1 something is wrong, 2 not read.
    Check {
        file: PathBuf,
        #[command(flatten)]
        verdicts: Verdicts,
        #[command(flatten)]
        output: Output,
    },
    /// Write a mesh in another format, given by the suffix of OUT or by --format
    Convert {
        #[arg(value_name = "IN")]
        input: PathBuf,
        #[arg(value_name = "OUT")]
        out: PathBuf,
        #[command(flatten)]
        form: Form,
        #[command(flatten)]
        output: Output,
    },
    /// Write the mesh of a scene
    Make {
        scene: String,
        #[arg(value_name = "OUT")]
        out: PathBuf,
        /// Refinement [default: the scene's own]
        #[arg(long, value_parser = clap::value_parser!(u32).range(1..))]
        n: Option<u32>,
        #[command(flatten)]
        trust: Trust,
        #[command(flatten)]
        form: Form,
        #[command(flatten)]
        output: Output,
    },
    /// Halve every edge
    Refine {
        #[arg(value_name = "IN")]
        input: PathBuf,
        #[arg(value_name = "OUT")]
        out: PathBuf,
        /// Number of refinements
        #[arg(long, default_value = "1", value_parser = clap::value_parser!(u32).range(1..=12))]
        times: u32,
        #[command(flatten)]
        form: Form,
        #[command(flatten)]
        output: Output,
    },
}

/// The form in which a mesh is written.
#[derive(Args)]
pub(in crate::cli) struct Form {
    #[arg(long, help = format!("{}, or a format of meshio's [default: what the suffix says]", native_names()))]
    pub format: Option<String>,
    /// Version of MSH: 2.2 or 4.1
    #[arg(long, default_value = "4.1")]
    pub msh_version: String,
    /// How numbers are written: MSH, Medit and VTK: ascii or binary; VTU and VTP: ascii, base64 or raw, the latter two with -zlib, -lz4 or -lzma
    /// [default: ascii for MSH, .mesh and VTK, raw-zlib for VTU and VTP]
    #[arg(long)]
    pub encoding: Option<String>,
    /// Warn of what the format cannot hold, instead of an error
    #[arg(long)]
    pub lossy: bool,
}
