// A page on this machine alone: one address with a token that nobody can guess, for browsers that
// were sent there.
#include "core/output/format.h"
#include "core/output/page/live_page.h"
#include "core/plugin/plugin.h"
#include "plugins/view/page_server.h"

namespace {

class Web final : public sim::View {
 public:
  explicit Web(const sim::ViewTask& task) : task_(task), server_(task.token, task.port) {
    renew(task.scene);
  }

  std::string address() const override {
    return "http://127.0.0.1:" + std::to_string(server_.port()) + "/" + task_.token + "/";
  }

  std::vector<sim::ViewMessage> wait(int milliseconds) override {
    return server_.wait(milliseconds);
  }

  void hold(bool on) override { server_.hold(on); }
  bool wants_frame() const override { return server_.wants_frame(); }

  void show(const sim::Moment& moment, const sim::ViewState& state) override {
    for (const std::uint64_t newcomer : server_.take_newcomers())
      server_.answer(newcomer, sim::LivePage::past(state.past));
    server_.show(page_->frame(moment, state));
  }

  void refuse(std::uint64_t to, const std::string& why) override {
    server_.answer(to, sim::JsonObject().text("error", why).str());
  }

  void renew(const sim::ViewScene& scene) override {
    page_ = std::make_unique<sim::LivePage>(scene, task_.pause_hidden);
    server_.set_page(page_->html("/" + task_.token + "/socket", task_.nonce),
                     sim::page_policy(task_.nonce));
  }

 private:
  sim::ViewTask task_;
  sim::PageServer server_;
  std::unique_ptr<sim::LivePage> page_;
};

}  // namespace

SIM_PLUGIN(View, "web") {
  registrar.add(sim::Plugin<sim::View>{
      {.name = "web",
       .summary = "a page in the browser: see, pull, pin, switch, travel in time",
       .formula = "sim view SCENE"},
      [](const sim::Params&, const sim::ViewTask& task) { return std::make_unique<Web>(task); }});
}
