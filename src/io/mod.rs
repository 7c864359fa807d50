//! Bytes to meshes and fields, and back.
