//! Writes the dress form in four further poses, arms raised stepwise and a step forward, as OBJ files of the same mesh:
//! `cargo run --no-default-features --example pose_form -- poses`, then
//! `partwise --from-body form --body poses --garment pullover-2`

use std::error::Error;
use std::path::Path;

use partwise::body::{BodySpec, dress_form};
use partwise::mesh::export::write_mesh;

#[path = "../tests/fixtures/poses.rs"]
mod poses;

fn main() -> Result<(), Box<dyn Error>> {
    let folder = std::env::args().nth(1).ok_or("found no argument, expected a folder for the poses")?;
    std::fs::create_dir_all(&folder)?;
    let form = dress_form(&BodySpec::default())?;
    for (number, (arms_deg, step_deg)) in (1..).zip(poses::FIVE).skip(1) {
        write_mesh(&Path::new(&folder).join(format!("pose-{number}.obj")), &poses::posed(&form, arms_deg, step_deg))?;
    }
    Ok(())
}
