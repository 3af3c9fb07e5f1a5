// A page that shows systems in a browser, without a network and without a library: a whole run, or
// one that goes on, whose frames come through a WebSocket.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "core/picture/moments.h"
#include "core/picture/quantity.h"
#include "core/picture/viewpoint.h"

namespace sim {

class Deflater;
class JsonObject;

// The Content-Security-Policy of a page whose script and style have that nonce: nothing else runs,
// and nothing is loaded from elsewhere.
std::string page_policy(const std::string& nonce);

class Page {
 public:
  // The viewpoint is found from all moments, of which there is at least one. They and the models
  // outlive the page.
  Page(std::span<const Model> models, const Moments& moments, const Look& look);

  // Positions are whole numbers of 16 bits in the bounding box of the motion, as differences from
  // moment to moment, low bytes before high ones, deflated. Empty if that is more than `most`
  // bytes.
  std::string of_run(std::size_t most) const { return made("null", "", most); }

  // `live`: JSON for H.live of the page. Its policy is sent by the server.
  std::string of_live(const std::string& live, const std::string& nonce) const;

  // The frame that of_live() draws next, see LivePage; with the values of the moment on the scale,
  // if any.
  std::string frame(const Moment& moment, std::string words,
                    const ColourScale* scale = nullptr) const;

  std::string solids(const Moment& moment, std::size_t system) const;  // JSON, as they are then

 private:
  struct Box;

  V3 own_axes(const V3& p) const;
  std::string made(const std::string& live, std::string nonce, std::size_t most) const;
  std::string tears_json(std::size_t m) const;
  std::string trails_json(std::size_t m) const;
  std::string model_json(std::size_t m, const Box& box) const;
  std::string camera_json() const;
  std::string energy_json(std::size_t m) const;
  std::string solids_json(std::size_t m) const;
  std::vector<float> points_of(std::size_t m, const Moment& moment) const;
  Box box_of(std::size_t m) const;
  void append_positions(std::size_t m, const Box& box, Deflater& data) const;
  std::vector<double> values_of(std::size_t m, const Moment& moment,
                                const ColourScale& scale) const;
  void append_values(std::size_t m, const Moment& moment, const ColourScale& scale,
                     std::string& out) const;
  bool measured() const;  // colours are values that the frames bring

  std::span<const Model> models_;
  Moments moments_;
  Look look_;
  Viewpoint view_;
  ColourScale scale_;
  Ground basis_;
};

// Frame::torn as one list of ids, for pages.
std::string torn_json(const Frame& frame);

}  // namespace sim
