//! The program and the real codes, run as users run them.
#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

mod accuracy;
mod certify;
mod codes;
mod common;
mod companions;
mod compare;
mod docs;
mod ending;
mod engines;
mod face_off;
mod false_alarms;
mod faults;
mod judge;
mod matrix;
mod mesh_faults;
mod mesh_formats;
mod mesh_info;
mod mutations;
mod numbering;
mod other_meshes;
mod paper;
mod pipelines;
mod python;
mod readers;
mod report;
mod rooms;
mod series;
mod settled;
mod solid;
mod study;
mod terminal;
mod trust;
mod unread;
mod vtk;
