//! What the drawn scene reaches.
//!
//! A file may hold what nothing draws: images without a texture, buffers that are not there, materials of another program, animations of what is not in
//! the scene. Nothing of that may stop a file, so it is replaced by harmless stand-ins of the same index before anything is validated. Buffers, buffer
//! views and images are taken out as they are and read when something asks for them.

use serde_json::{Map, Value, json};
use std::collections::{BTreeSet, HashMap};

/// What a document does not hold: what is read only when something asks for it.
#[derive(Default)]
pub(crate) struct Raw {
    /// As written.
    pub buffers: Vec<Value>,
    /// As written.
    pub views: Vec<Value>,
    /// As written.
    pub images: Vec<Value>,
    /// For each texture, the images that can serve it, the best first.
    pub texture_images: Vec<Vec<usize>>,
    /// Buffer views that hold a primitive compressed by Draco.
    pub draco_views: Vec<usize>,
    /// Accessors whose elements such a primitive holds.
    pub draco: HashMap<usize, DracoPart>,
}

/// Where in a compressed primitive the elements of an accessor are.
#[derive(Clone, Copy, Debug)]
pub(crate) struct DracoPart {
    /// Index into [`Raw::draco_views`].
    pub primitive: usize,
    /// The attribute's identifier; indices if there is none.
    pub attribute: Option<u32>,
}

/// Attributes that are read, but for their number.
const ATTRIBUTES: [&str; 7] = ["POSITION", "NORMAL", "TANGENT", "TEXCOORD_", "COLOR_", "JOINTS_", "WEIGHTS_"];

/// Extensions of a texture whose images are read, the first that is there before the texture's own image.
const TEXTURE_EXTENSIONS: [&str; 2] = ["EXT_texture_webp", "KHR_texture_basisu"];

const DRACO: &str = "KHR_draco_mesh_compression";

fn index(value: Option<&Value>) -> Option<usize> {
    value.and_then(Value::as_u64).and_then(|index| usize::try_from(index).ok())
}

fn list<'a>(root: &'a Value, name: &str) -> &'a [Value] {
    root.get(name).and_then(Value::as_array).map_or(&[], Vec::as_slice)
}

fn list_mut<'a>(root: &'a mut Value, name: &str) -> impl Iterator<Item = (usize, &'a mut Value)> {
    root.get_mut(name).and_then(Value::as_array_mut).into_iter().flatten().enumerate()
}

/// Takes a list out and leaves as many stand-ins.
fn take(root: &mut Value, name: &str, stand_in: &Value) -> Vec<Value> {
    let Some(Value::Array(list)) = root.get_mut(name) else { return Vec::new() };
    let stand_ins = vec![stand_in.clone(); list.len()];
    std::mem::replace(list, stand_ins)
}

/// Replaces what is not among `reached` by a stand-in that keeps the name.
fn keep(root: &mut Value, name: &str, reached: &BTreeSet<usize>, stand_in: &Value) {
    for (index, value) in list_mut(root, name) {
        if !reached.contains(&index) {
            let name = value.get("name").filter(|name| name.is_string()).cloned();
            *value = stand_in.clone();
            if let Some(name) = name {
                value["name"] = name;
            }
        }
    }
}

/// Indices of the things that something refers to.
#[derive(Default)]
struct Reached {
    nodes: BTreeSet<usize>,
    joints: BTreeSet<usize>,
    meshes: BTreeSet<usize>,
    skins: BTreeSet<usize>,
    cameras: BTreeSet<usize>,
    lights: BTreeSet<usize>,
    materials: BTreeSet<usize>,
    textures: BTreeSet<usize>,
    samplers: BTreeSet<usize>,
    accessors: BTreeSet<usize>,
}

/// Reduces a document to what it draws, and says what that changes.
pub(super) fn reduce(root: &mut Value) -> (Raw, Vec<String>) {
    let mut raw = Raw::default();
    let mut warnings = Vec::new();
    if !root.is_object() {
        return (raw, warnings);
    }
    choose_scene(root);
    let mut reached = Reached::default();
    nodes(root, &mut reached);
    node_contents(root, &mut reached);
    animations(root, &mut reached, &mut warnings);
    primitives(root, &mut reached, &mut raw);
    textures(root, &mut reached, &mut raw, &mut warnings);
    stand_ins(root, &reached);
    raw.buffers = take(root, "buffers", &json!({"byteLength": 1}));
    raw.views = take(root, "bufferViews", &json!({"buffer": 0, "byteLength": 1}));
    raw.images = take(root, "images", &json!({}));
    if raw.buffers.is_empty() && !raw.views.is_empty() {
        root["buffers"] = json!([{"byteLength": 1}]);
    }
    (raw, warnings)
}

/// Without a choice, the first scene that has nodes; the others lose theirs.
fn choose_scene(root: &mut Value) {
    let scenes = list(root, "scenes");
    let has_nodes = |scene: &Value| scene.get("nodes").and_then(Value::as_array).is_some_and(|nodes| !nodes.is_empty());
    if !scenes.is_empty() && root.get("scene").is_none_or(Value::is_null) {
        root["scene"] = json!(scenes.iter().position(has_nodes).unwrap_or(0));
    }
    let chosen = index(root.get("scene"));
    for (index, scene) in list_mut(root, "scenes") {
        if Some(index) != chosen {
            *scene = json!({"nodes": []});
        } else if let Value::Object(scene) = scene {
            scene.entry("nodes").or_insert_with(|| json!([]));
        }
    }
}

/// The nodes of the scene, by way of children.
fn nodes(root: &Value, reached: &mut Reached) {
    let all = list(root, "nodes");
    let children = |node: &Value| -> Vec<usize> { list(node, "children").iter().filter_map(|child| index(Some(child))).collect() };
    let chosen = index(root.get("scene")).and_then(|scene| list(root, "scenes").get(scene));
    let mut open: Vec<usize> = match chosen {
        Some(scene) => list(scene, "nodes").iter().filter_map(|node| index(Some(node))).collect(),
        None => {
            let below: BTreeSet<usize> = all.iter().flat_map(children).collect();
            (0..all.len()).filter(|node| !below.contains(node)).collect()
        }
    };
    while let Some(node) = open.pop() {
        if let Some(value) = all.get(node).filter(|_| reached.nodes.insert(node)) {
            open.extend(children(value));
        }
    }
}

/// What hangs on the nodes of the scene. Other nodes keep their place in the tree, and nothing else.
fn node_contents(root: &mut Value, reached: &mut Reached) {
    for node in &reached.nodes {
        let Some(node) = list(root, "nodes").get(*node) else { continue };
        reached.meshes.extend(index(node.get("mesh")));
        reached.skins.extend(index(node.get("skin")));
        reached.cameras.extend(index(node.get("camera")));
        reached.lights.extend(index(node.pointer("/extensions/KHR_lights_punctual/light")));
        let instancing = node.pointer("/extensions/EXT_mesh_gpu_instancing/attributes").and_then(Value::as_object);
        reached.accessors.extend(instancing.into_iter().flat_map(Map::values).filter_map(|accessor| index(Some(accessor))));
    }
    for skin in &reached.skins {
        let Some(skin) = list(root, "skins").get(*skin) else { continue };
        reached.accessors.extend(index(skin.get("inverseBindMatrices")));
        reached.joints.extend(list(skin, "joints").iter().filter_map(|joint| index(Some(joint))));
    }
    // A joint is placed by all nodes above it, whether they are drawn or not.
    let parents: HashMap<usize, usize> = list(root, "nodes")
        .iter()
        .enumerate()
        .flat_map(|(parent, node)| list(node, "children").iter().filter_map(move |child| Some((index(Some(child))?, parent))))
        .collect();
    let mut open: Vec<usize> = reached.joints.iter().copied().collect();
    while let Some(joint) = open.pop() {
        open.extend(parents.get(&joint).filter(|parent| reached.joints.insert(**parent)));
    }
    let count = list(root, "nodes").len();
    for (place, node) in list_mut(root, "nodes") {
        if reached.nodes.contains(&place) {
            continue;
        }
        let mut rest = Map::new();
        let children: Vec<&Value> =
            list(node, "children").iter().filter(|child| index(Some(child)).is_some_and(|child| child < count)).collect();
        if !children.is_empty() {
            rest.insert("children".into(), json!(children));
        }
        for (key, length) in [("translation", 3), ("rotation", 4), ("scale", 3), ("matrix", 16)] {
            let numbers = node.get(key).filter(|_| reached.joints.contains(&place));
            let fine = |numbers: &&Value| {
                numbers.as_array().is_some_and(|numbers| numbers.len() == length && numbers.iter().all(Value::is_number))
            };
            if let Some(numbers) = numbers.filter(fine) {
                rest.insert(key.into(), numbers.clone());
            }
        }
        *node = Value::Object(rest);
    }
}

/// Channels that move what is there, with the samplers that they need.
fn animations(root: &mut Value, reached: &mut Reached, warnings: &mut Vec<String>) {
    const PATHS: [&str; 4] = ["translation", "rotation", "scale", "weights"];
    let count = list(root, "nodes").len();
    let (mut skipped, mut first) = (0, String::new());
    for (_, animation) in list_mut(root, "animations") {
        let Some(Value::Array(channels)) = animation.get_mut("channels") else {
            *animation = json!({"channels": [], "samplers": []});
            continue;
        };
        channels.retain(|channel| {
            let path = channel.pointer("/target/path").and_then(Value::as_str).unwrap_or_default();
            let node = channel.pointer("/target/node");
            if !PATHS.contains(&path) || node.is_none() {
                skipped += 1;
                if first.is_empty() {
                    first = channel
                        .pointer("/target/extensions/KHR_animation_pointer/pointer")
                        .and_then(Value::as_str)
                        .map_or_else(|| format!("`{path}`"), |pointer| format!("`{pointer}`"));
                }
                return false;
            }
            index(node).is_none_or(|node| node >= count || reached.nodes.contains(&node) || reached.joints.contains(&node))
        });
        let used: BTreeSet<usize> = channels.iter().filter_map(|channel| index(channel.get("sampler"))).collect();
        let samplers = animation.get_mut("samplers").and_then(Value::as_array_mut);
        let Some(samplers) = samplers.filter(|_| !used.is_empty()) else {
            animation["samplers"] = json!([]);
            continue;
        };
        let spare = used.iter().find_map(|sampler| samplers.get(*sampler)).cloned();
        for (place, sampler) in samplers.iter_mut().enumerate() {
            if !used.contains(&place) {
                *sampler = spare.clone().unwrap_or_default();
            }
            reached.accessors.extend(index(sampler.get("input")).into_iter().chain(index(sampler.get("output"))));
        }
    }
    if skipped > 0 {
        warnings.push(format!("animation channels that move no transform of a node are skipped: {skipped}, first {first}"));
    }
}

/// What the primitives need. Those that are no triangles need nothing.
fn primitives(root: &mut Value, reached: &mut Reached, raw: &mut Raw) {
    let mut accessors = match root.get_mut("accessors") {
        Some(Value::Array(accessors)) => std::mem::take(accessors),
        _ => Vec::new(),
    };
    for (place, mesh) in list_mut(root, "meshes") {
        if !reached.meshes.contains(&place) {
            continue;
        }
        if let Value::Object(mesh) = mesh {
            mesh.entry("primitives").or_insert_with(|| json!([]));
        }
        for (_, primitive) in list_mut(mesh, "primitives") {
            let Value::Object(primitive) = primitive else { continue };
            if index(primitive.get("mode")).is_some_and(|mode| mode < 4) {
                primitive.retain(|key, _| key == "mode");
                primitive.insert("attributes".into(), json!({}));
                continue;
            }
            if let Some(Value::Object(attributes)) = primitive.get_mut("attributes") {
                attributes.retain(|name, _| {
                    ATTRIBUTES.iter().any(|known| match name.strip_prefix(known) {
                        Some(set) if known.ends_with('_') => set.parse::<u32>().is_ok(),
                        Some(set) => set.is_empty(),
                        None => false,
                    })
                });
            }
            decompress(primitive, &mut accessors, raw);
            let attributes = primitive.get("attributes").into_iter();
            let targets = primitive.get("targets").and_then(Value::as_array).into_iter().flatten();
            let all = attributes.chain(targets).filter_map(Value::as_object).flat_map(Map::values);
            reached.accessors.extend(all.chain(primitive.get("indices")).filter_map(|accessor| index(Some(accessor))));
            reached.materials.extend(index(primitive.get("material")));
        }
    }
    if !accessors.is_empty() {
        root["accessors"] = Value::Array(accessors);
    }
}

/// Gives a primitive that Draco compressed accessors of its own, whose elements come out of the compressed data.
fn decompress(primitive: &mut Map<String, Value>, accessors: &mut Vec<Value>, raw: &mut Raw) {
    let extension = primitive.get("extensions").and_then(|extensions| extensions.get(DRACO)).cloned();
    let Some((extension, view)) = extension.and_then(|extension| Some((extension.clone(), index(extension.get("bufferView"))?))) else {
        return;
    };
    let identifiers = extension.get("attributes").and_then(Value::as_object).cloned().unwrap_or_default();
    raw.draco_views.push(view);
    let compressed = raw.draco_views.len() - 1;
    let mut add = |old: Option<usize>, attribute: Option<u32>, otherwise: Value| {
        // One with a view of its own is what is drawn where decoding fails.
        let mut accessor = old.and_then(|old| accessors.get(old)).cloned().unwrap_or(otherwise);
        if let Value::Object(accessor) = &mut accessor
            && attribute.is_none()
            && !accessor.contains_key("bufferView")
        {
            accessor.insert("componentType".into(), json!(5125));
        }
        accessors.push(accessor);
        raw.draco.insert(accessors.len() - 1, DracoPart { primitive: compressed, attribute });
        json!(accessors.len() - 1)
    };
    if let Some(Value::Object(attributes)) = primitive.get_mut("attributes") {
        for (name, accessor) in attributes.iter_mut() {
            let identifier = identifiers.get(name).and_then(Value::as_u64).and_then(|identifier| u32::try_from(identifier).ok());
            if let (Some(old), Some(identifier)) = (index(Some(accessor)), identifier) {
                *accessor = add(Some(old), Some(identifier), json!(null));
            }
        }
    }
    let indices = add(index(primitive.get("indices")), None, json!({"count": 1, "type": "SCALAR"}));
    primitive.insert("indices".into(), indices);
    // What comes out is a list of triangles.
    primitive.insert("mode".into(), json!(4));
}

/// Textures of the materials that are drawn, and their images. A material loses its occlusion texture, which is not drawn, and textures that have no
/// image at all.
fn textures(root: &mut Value, reached: &mut Reached, raw: &mut Raw, warnings: &mut Vec<String>) {
    let sources = |texture: &Value| -> Vec<usize> {
        let extensions = texture.get("extensions").and_then(Value::as_object);
        let source =
            |name: &str| index(extensions.and_then(|extensions| extensions.get(name)).and_then(|extension| extension.get("source")));
        let ours = TEXTURE_EXTENSIONS.iter().filter_map(|name| source(name));
        let others = extensions.into_iter().flat_map(Map::keys).filter(|name| !TEXTURE_EXTENSIONS.contains(&name.as_str()));
        ours.chain(index(texture.get("source"))).chain(others.filter_map(|name| source(name))).collect()
    };
    raw.texture_images = list(root, "textures").iter().map(sources).collect();
    let mut occlusion = false;
    let mut absent = BTreeSet::new();
    for (place, material) in list_mut(root, "materials") {
        if !reached.materials.contains(&place) {
            continue;
        }
        if let Value::Object(material) = material {
            occlusion |= material.remove("occlusionTexture").is_some();
        }
        drop_textures(material, &raw.texture_images, &mut reached.textures, &mut absent);
    }
    if occlusion {
        warnings.push("occlusion textures are ignored: light is computed, not painted".into());
    }
    if !absent.is_empty() {
        let names: Vec<String> = absent.iter().map(|texture: &usize| texture.to_string()).collect();
        warnings.push(format!("textures without an image are ignored: {}", names.join(", ")));
    }
    let images = list(root, "images").len();
    for (place, texture) in list_mut(root, "textures") {
        if !reached.textures.contains(&place) {
            *texture = json!({"source": 0});
            continue;
        }
        reached.samplers.extend(index(texture.get("sampler")));
        if let (Value::Object(texture), Some(source)) = (texture, raw.texture_images[place].iter().find(|source| **source < images)) {
            texture.insert("source".into(), json!(source));
        }
    }
    if images == 0 && !raw.texture_images.is_empty() {
        root["images"] = json!([{}]);
    }
}

/// Collects the textures below a value, and takes away those that have no image.
fn drop_textures(value: &mut Value, images: &[Vec<usize>], reached: &mut BTreeSet<usize>, absent: &mut BTreeSet<usize>) {
    let Value::Object(object) = value else { return };
    object.retain(|key, below| {
        let texture = index(below.get("index")).filter(|_| key.ends_with("Texture"));
        match texture {
            Some(texture) if images.get(texture).is_some_and(Vec::is_empty) => {
                absent.insert(texture);
                return false;
            }
            Some(texture) => _ = reached.insert(texture),
            None => drop_textures(below, images, reached, absent),
        }
        true
    });
}

fn stand_ins(root: &mut Value, reached: &Reached) {
    keep(root, "meshes", &reached.meshes, &json!({"primitives": []}));
    keep(root, "skins", &reached.skins, &json!({"joints": []}));
    keep(root, "cameras", &reached.cameras, &json!({"type": "perspective", "perspective": {"yfov": 1.0, "znear": 1.0}}));
    keep(root, "materials", &reached.materials, &json!({}));
    keep(root, "samplers", &reached.samplers, &json!({}));
    keep(root, "accessors", &reached.accessors, &json!({"componentType": 5126, "count": 1, "type": "SCALAR"}));
    if let Some(lights) = root.pointer_mut("/extensions/KHR_lights_punctual") {
        keep(lights, "lights", &reached.lights, &json!({"type": "point"}));
    }
}
