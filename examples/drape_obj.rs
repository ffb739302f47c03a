//! Drapes an OBJ garment over an OBJ body and writes it back with its own faces, groups and texture coordinates:
//! `cargo run --no-default-features --example drape_obj -- me.obj shirt.obj draped.obj`

#![allow(clippy::print_stdout, clippy::print_stderr, reason = "an example prints")]

use std::error::Error;

use partwise::{SceneSpec, Settings};

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [body, garment, out] = arguments.as_slice() else {
        return Err(format!("found {} arguments, expected BODY.obj GARMENT.obj OUT.obj", arguments.len()).into());
    };
    let input = SceneSpec::new(body, garment).load()?;
    input.notes().iter().chain(&input.warnings()).for_each(|line| eprintln!("{line}"));
    let draped = input.scene.drape(&Settings::default())?;
    draped.warnings.iter().for_each(|line| eprintln!("{line}"));
    println!("{} PARTs, {} vertices inside the body", draped.parts.len(), draped.penetrating_vertices);
    input.write(out, &draped.positions)?;
    Ok(())
}
