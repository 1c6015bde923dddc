//! The nodes of a scene: which primitives of Gaussians it shows, and where.

use super::document::{Document, Node, Primitive, broken};
use super::note_others;
use super::placement::Placement;
use crate::error::SceneError;
use crate::limits::Budget;
use glam::{DMat4, DQuat, DVec3};

const WHAT: &str = "the nodes of the scene";

/// A primitive where the scene shows it.
pub(super) struct Part<'a> {
    /// What it is called in messages.
    pub(super) mesh: usize,
    pub(super) index: usize,
    pub(super) primitive: &'a Primitive,
    pub(super) placement: Placement,
}

/// The primitives of Gaussians of the scene, in the order of its nodes: a node, then its children.
pub(super) fn gaussians<'a>(
    document: &'a Document,
    budget: &mut Budget,
) -> Result<Vec<Part<'a>>, SceneError> {
    let mut parts = Vec::new();
    let (mut others, mut is_seen) = (0_u64, budget.room(document.nodes.len() as u64, WHAT)?);
    is_seen.resize(document.nodes.len(), false);
    // The last is the next.
    let mut waiting: Vec<(u32, DMat4)> =
        roots(document)?.into_iter().rev().map(|node| (node, DMat4::IDENTITY)).collect();
    budget.take((waiting.len() as u64).saturating_mul(size_of::<(u32, DMat4)>() as u64), WHAT)?;
    while let Some((index, parent)) = waiting.pop() {
        let node =
            document.nodes.get(index as usize).ok_or_else(|| broken(format!("there is no node {index}")))?;
        if is_seen.get_mut(index as usize).is_none_or(|seen| std::mem::replace(seen, true)) {
            return Err(broken(format!("node {index} comes twice: nodes must be a tree")));
        }
        let matrix = parent * own_matrix(node);
        others = others.saturating_add(take_mesh(document, node, (index, matrix), &mut parts, budget)?);
        budget.take((node.children.len() as u64).saturating_mul(size_of::<(u32, DMat4)>() as u64), WHAT)?;
        waiting.extend(node.children.iter().rev().map(|&child| (child, matrix)));
    }
    note_others(others, budget);
    if parts.is_empty() {
        let what = "the scene of this glTF has no primitive with KHR_gaussian_splatting";
        return Err(SceneError::inconsistent(what, "it holds no Gaussians; export them with that extension"));
    }
    Ok(parts)
}

/// The nodes that a scene starts with; of a file without scenes, those that are nobody's children.
fn roots(document: &Document) -> Result<Vec<u32>, SceneError> {
    let scene = document.scene.unwrap_or(0);
    match document.scenes.get(scene as usize) {
        Some(scene) => Ok(scene.nodes.to_vec()),
        None if document.scene.is_some() => Err(broken(format!("there is no scene {scene}"))),
        None => {
            let mut is_root = vec![true; document.nodes.len()];
            for &child in document.nodes.iter().flat_map(|node| &node.children) {
                is_root.get_mut(child as usize).into_iter().for_each(|is_root| *is_root = false);
            }
            Ok((0..).zip(is_root).filter(|&(_, is_root)| is_root).map(|(node, _)| node).collect())
        }
    }
}

/// Adds the Gaussians of a node's mesh, and counts its other primitives.
fn take_mesh<'a>(
    document: &'a Document,
    node: &Node,
    (index, matrix): (u32, DMat4),
    parts: &mut Vec<Part<'a>>,
    budget: &mut Budget,
) -> Result<u64, SceneError> {
    let Some(mesh) = node.mesh else { return Ok(0) };
    let found = document.meshes.get(mesh as usize);
    let found = found.ok_or_else(|| broken(format!("there is no mesh {mesh}")))?;
    // A vector that grows is there twice for a moment. Primitives of other kinds count too: many nodes may show one mesh.
    let bytes = (size_of::<Part<'_>>() as u64).saturating_mul(3);
    budget.take((found.primitives.len() as u64).saturating_mul(bytes), WHAT)?;
    let mut others = 0_u64;
    for (at, primitive) in found.primitives.iter().enumerate() {
        if !primitive.is_gaussians() {
            others = others.saturating_add(1);
            continue;
        }
        let placement = Placement::of(matrix).ok_or_else(|| {
            let what = format!("node {index} is mirrored, sheared or flattened, which Gaussians cannot be");
            SceneError::unsupported(what, "apply the transform where the scene was made")
        })?;
        parts.push(Part { mesh: mesh as usize, index: at, primitive, placement });
    }
    Ok(others)
}

/// The transform of a node itself.
fn own_matrix(node: &Node) -> DMat4 {
    if let Some(matrix) = &node.matrix {
        return DMat4::from_cols_array(matrix);
    }
    let vector = |values: &Option<Box<[f64; 3]>>, usual| {
        values.as_deref().map_or(usual, |&values| DVec3::from(values))
    };
    let rotation = node.rotation.as_deref().map_or(DQuat::IDENTITY, |&parts| DQuat::from_array(parts));
    let (scale, translation) = (vector(&node.scale, DVec3::ONE), vector(&node.translation, DVec3::ZERO));
    // A rotation without direction gives numbers that are none, which placing refuses.
    DMat4::from_scale_rotation_translation(scale, rotation / rotation.length(), translation)
}
