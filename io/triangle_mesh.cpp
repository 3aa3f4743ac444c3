// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/triangle_mesh.h"

#include <assimp/postprocess.h>
#include <assimp/scene.h>

#include <assimp/Importer.hpp>

#include "geometry/error.h"
#include "io/file.h"

namespace toile {

namespace {

// Meshes of all nodes below, in the root's axes.
void append(const aiScene& scene, const aiNode& node, const aiMatrix4x4& parent, std::vector<Eigen::Vector3d>& vertices,
            TriangleMesh& out) {
  const aiMatrix4x4 place = parent * node.mTransformation;
  for (unsigned k = 0; k < node.mNumMeshes; ++k) {
    const aiMesh& mesh = *scene.mMeshes[node.mMeshes[k]];
    const int first = static_cast<int>(vertices.size());
    for (unsigned i = 0; i < mesh.mNumVertices; ++i) {
      const aiVector3D x = place * mesh.mVertices[i];
      vertices.emplace_back(x.x, x.y, x.z);
    }
    for (unsigned i = 0; i < mesh.mNumFaces; ++i) {
      const aiFace& face = mesh.mFaces[i];
      if (face.mNumIndices != 3) continue;
      out.triangles.push_back({first + static_cast<int>(face.mIndices[0]), first + static_cast<int>(face.mIndices[1]),
                               first + static_cast<int>(face.mIndices[2])});
    }
  }
  for (unsigned k = 0; k < node.mNumChildren; ++k) append(scene, *node.mChildren[k], place, vertices, out);
}

}  // namespace

TriangleMesh read_mesh(const std::filesystem::path& path) {
  // Our own reading says why a file can't be opened.
  const std::string bytes = read_file(path);
  Assimp::Importer importer;
  // Positions alone: normals and texture coordinates would keep apart vertices that are one.
  importer.SetPropertyInteger(AI_CONFIG_PP_RVC_FLAGS, aiComponent_NORMALS | aiComponent_TANGENTS_AND_BITANGENTS |
                                                          aiComponent_TEXCOORDS | aiComponent_COLORS |
                                                          aiComponent_MATERIALS | aiComponent_TEXTURES);
  std::string ending = path.extension().string();
  if (!ending.empty()) ending.erase(0, 1);
  if (!importer.IsExtensionSupported(ending))
    throw InputError(path.string() + ": '" + ending + "' is no mesh format that can be read; use obj, ply, stl or glb");
  // assimp looks for the end of a PLY header for ever.
  if (bytes.starts_with("ply") && bytes.find("end_header") == std::string::npos)
    throw InputError(path.string() + ": no mesh: the PLY header has no end_header");
  const aiScene* scene =
      importer.ReadFileFromMemory(bytes.data(), bytes.size(),
                                  aiProcess_RemoveComponent | aiProcess_Triangulate | aiProcess_JoinIdenticalVertices |
                                      aiProcess_ValidateDataStructure,
                                  ending.c_str());
  if (!scene || !scene->mRootNode) throw InputError(path.string() + ": no mesh: " + importer.GetErrorString());
  TriangleMesh out;
  std::vector<Eigen::Vector3d> vertices;
  append(*scene, *scene->mRootNode, aiMatrix4x4(), vertices, out);
  if (out.triangles.empty()) throw InputError(path.string() + ": holds no triangle");
  out.vertices.resize(3, static_cast<Eigen::Index>(vertices.size()));
  for (std::size_t k = 0; k < vertices.size(); ++k) {
    out.vertices.col(static_cast<Eigen::Index>(k)) = vertices[k];
    if (!vertices[k].allFinite()) throw InputError(path.string() + ": vertex " + std::to_string(k) + " is not finite");
  }
  return out;
}

}  // namespace toile
