// The page of a running scene: its HTML, and the frames that it draws.
#pragma once

#include <span>
#include <string>

#include "core/output/page/page.h"
#include "core/output/view.h"

namespace sim {

class LivePage {
 public:
  // The objects of the scene outlive it.
  LivePage(const ViewScene& scene, bool pause_hidden);

  // `socket`: the path of its WebSocket.
  std::string html(const std::string& socket, const std::string& nonce) const;

  // The length of the words as four bytes, the words (JSON), and for each system the low corner of
  // its box and a quantum as floats, then positions as whole numbers of 16 bits and, where the
  // words name them, values in 255ths of their scale. Numbers are little-endian and begin at a
  // multiple of four.
  std::string frame(const Moment& moment, const ViewState& state);

  static std::string past(std::span<const EnergySample> samples);  // the strip of energies, JSON

 private:
  ViewScene scene_;
  bool pause_hidden_;
  Page page_;
  double most_ = 0;  // of the scale of the values
};

}  // namespace sim
