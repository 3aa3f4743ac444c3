// Triangles as Wavefront OBJ.
#pragma once

#include <filesystem>
#include <string>

#include "io/frame.h"

namespace toile {

// The material of all panels: metres, scene axes, one group per panel, texture coordinates = parameters of the panel.
std::string format_obj(const Frame& frame);

// Writes FOLDER/frame_0000.obj and so on. `next`: number of the first frame (a resumed run starts later).
class ObjSink : public FrameSink {
 public:
  explicit ObjSink(std::filesystem::path folder, int next = 0);
  void write(const Frame& frame) override;

 private:
  std::filesystem::path folder_;
  int next_;
};

}  // namespace toile
