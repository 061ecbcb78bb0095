#include "client/ros2/node.h"

#include <algorithm>
#include <cstdlib>
#include <cstring>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/string_view.h"
#include "absl/time/time.h"
#include <dds/ddsi/ddsi_serdata.h>

#include "client/ros2/ros_types.h"
#include "core/common/status.h"

namespace strata::ros2 {
namespace {

// Clouds come in bursts of their fragments; the kernel's default holds a tenth of one.
constexpr absl::string_view kLargeBuffers =
    "<Internal><SocketReceiveBufferSize min=\"default\" max=\"16MiB\"/></Internal>";
// As rmw_cyclonedds takes ROS_LOCALHOST_ONLY. Loopback has no multicast: everybody asks everybody.
constexpr absl::string_view kThisMachine =
    "<General><Interfaces><NetworkInterface address=\"127.0.0.1\"/></Interfaces>"
    "<AllowMulticast>false</AllowMulticast></General>"
    "<Discovery><ParticipantIndex>auto</ParticipantIndex><MaxAutoParticipantIndex>32"
    "</MaxAutoParticipantIndex><Peers><Peer address=\"127.0.0.1\"/></Peers></Discovery>";

absl::string_view Environment(const char* name) {
  const char* const value = std::getenv(name);
  return value == nullptr ? "" : value;
}

// Later parts go before earlier ones.
std::string Configuration() {
  std::string text = absl::StrCat("<CycloneDDS><Domain>",
                                  kLargeBuffers,
                                  Environment("ROS_LOCALHOST_ONLY") == "1" ? kThisMachine : "",
                                  "</Domain></CycloneDDS>");
  const absl::string_view own = Environment("CYCLONEDDS_URI");
  if (!own.empty()) absl::StrAppend(&text, ",", own);
  return text;
}

absl::Status Failed(absl::string_view what, dds_return_t code) {
  return absl::UnavailableError(absl::StrCat(what, ": ", dds_strretcode(-code)));
}

absl::StatusOr<Entity> Made(absl::string_view what, dds_entity_t handle) {
  if (handle < 0) return Failed(what, handle);
  return Entity(handle);
}

struct QosDelete {
  void operator()(dds_qos_t* qos) const { dds_delete_qos(qos); }
};
using QosPtr = std::unique_ptr<dds_qos_t, QosDelete>;

QosPtr QosOf(const RosQos& wanted) {
  // How long Write may wait. Another time than the default of 100 ms: Cyclone DDS leaves defaults
  // out of what it announces, and not everybody who listens knows them.
  constexpr dds_duration_t kLongestWait = DDS_MSECS(50);
  QosPtr qos(dds_create_qos());
  dds_qset_reliability(qos.get(),
                       wanted.reliable ? DDS_RELIABILITY_RELIABLE : DDS_RELIABILITY_BEST_EFFORT,
                       kLongestWait);
  dds_qset_history(qos.get(), DDS_HISTORY_KEEP_LAST, wanted.depth);
  dds_qset_durability(
      qos.get(), wanted.transient_local ? DDS_DURABILITY_TRANSIENT_LOCAL : DDS_DURABILITY_VOLATILE);
  if (wanted.transient_local) {
    // What a writer keeps for those who come later.
    dds_qset_durability_service(qos.get(),
                                0,
                                DDS_HISTORY_KEEP_LAST,
                                wanted.depth,
                                DDS_LENGTH_UNLIMITED,
                                DDS_LENGTH_UNLIMITED,
                                DDS_LENGTH_UNLIMITED);
  }
  dds_qset_ignorelocal(qos.get(), DDS_IGNORELOCAL_PARTICIPANT);
  return qos;
}

// The bytes of a message, and what holds them.
struct Serialized {
  explicit Serialized(ddsi_serdata* taken) : data(taken) {
    lent = ddsi_serdata_to_ser_ref(data, 0, ddsi_serdata_size(data), &bytes);
  }
  ~Serialized() {
    ddsi_serdata_to_ser_unref(lent, &bytes);
    ddsi_serdata_unref(data);
  }
  Serialized(const Serialized&) = delete;
  Serialized& operator=(const Serialized&) = delete;

  ddsi_serdata* data;
  ddsi_serdata* lent = nullptr;
  ddsrt_iovec_t bytes{};
};

bool IsReliable(const dds_qos_t* qos) {
  dds_reliability_kind_t kind = DDS_RELIABILITY_BEST_EFFORT;
  return dds_qget_reliability(qos, &kind, nullptr) && kind == DDS_RELIABILITY_RELIABLE;
}

}  // namespace

Entity::~Entity() {
  if (handle_ > 0) dds_delete(handle_);
}

absl::StatusOr<std::unique_ptr<Node>> Node::Create(int domain) {
  std::unique_ptr<Node> node(new Node());
  const auto number = static_cast<dds_domainid_t>(domain);
  STRATA_ASSIGN_OR_RETURN(
      node->domain_,
      Made(absl::StrCat("DDS domain ",
                        domain,
                        " (look at CYCLONEDDS_URI, and at what Cyclone DDS said "
                        "above)"),
           dds_create_domain(number, Configuration().c_str())));
  STRATA_ASSIGN_OR_RETURN(
      node->participant_,
      Made(absl::StrCat("DDS domain ", domain, ": no participant (is there a network?)"),
           dds_create_participant(number, nullptr, nullptr)));
  dds_guid_t guid;
  if (const dds_return_t got = dds_get_guid(node->participant_.handle(), &guid); got < 0) {
    return Failed("the participant's GUID", got);
  }
  std::copy(std::begin(guid.v), std::end(guid.v), node->guid_.begin());
  STRATA_ASSIGN_OR_RETURN(node->waitset_,
                          Made("a waitset", dds_create_waitset(node->participant_.handle())));
  STRATA_ASSIGN_OR_RETURN(
      node->publications_,
      Made("who publishes",
           dds_create_reader(
               node->participant_.handle(), DDS_BUILTIN_TOPIC_DCPSPUBLICATION, nullptr, nullptr)));
  STRATA_RETURN_IF_ERROR(node->Attach(node->publications_));
  return node;
}

absl::Status Node::Attach(const Entity& reader) const {
  dds_return_t done = dds_set_status_mask(reader.handle(), DDS_DATA_AVAILABLE_STATUS);
  if (done >= 0) done = dds_waitset_attach(waitset_.handle(), reader.handle(), 0);
  return done < 0 ? Failed("waiting for messages", done) : absl::OkStatus();
}

absl::StatusOr<Entity> Node::MakeTopic(const std::string& topic, absl::string_view type) {
  return Made(absl::StrCat("topic ", topic, " of type ", type),
              dds_create_topic(participant_.handle(),
                               DescriptorOf(type),
                               DdsTopicName(topic).c_str(),
                               nullptr,
                               nullptr));
}

absl::StatusOr<Entity> Node::MakeReader(const std::string& topic,
                                        absl::string_view type,
                                        const RosQos& qos) {
  // Readers and writers hold their topic.
  STRATA_ASSIGN_OR_RETURN(const Entity named, MakeTopic(topic, type));
  STRATA_ASSIGN_OR_RETURN(
      Entity reader,
      Made(absl::StrCat("reader of ", topic),
           dds_create_reader(participant_.handle(), named.handle(), QosOf(qos).get(), nullptr)));
  STRATA_RETURN_IF_ERROR(Attach(reader));
  return reader;
}

absl::StatusOr<Entity> Node::MakeWriter(const std::string& topic,
                                        absl::string_view type,
                                        const RosQos& qos) {
  STRATA_ASSIGN_OR_RETURN(const Entity named, MakeTopic(topic, type));
  return Made(absl::StrCat("writer of ", topic),
              dds_create_writer(participant_.handle(), named.handle(), QosOf(qos).get(), nullptr));
}

std::vector<CdrMessage> Node::Take(const Entity& reader, std::size_t most) {
  std::vector<CdrMessage> messages;
  if (!reader) return messages;
  while (messages.size() < most) {
    ddsi_serdata* data = nullptr;
    dds_sample_info_t info;
    if (dds_takecdr(reader.handle(), &data, 1, &info, DDS_ANY_STATE) < 1) break;
    auto whole = std::make_shared<const Serialized>(data);
    if (!info.valid_data) continue;  // somebody ended
    const absl::string_view bytes(static_cast<const char*>(whole->bytes.iov_base),
                                  whole->bytes.iov_len);
    messages.push_back({std::move(whole), bytes});
  }
  return messages;
}

absl::Status Node::Write(const Entity& writer, const void* message) {
  const dds_return_t written = dds_write(writer.handle(), message);
  return written < 0 ? Failed("a message was not sent", written) : absl::OkStatus();
}

void Node::Wait(absl::Duration longest) const {
  dds_waitset_wait(waitset_.handle(), nullptr, 0, absl::ToInt64Nanoseconds(longest));
}

bool Node::UpdateOffers() {
  bool changed = false;
  while (true) {
    void* sample = nullptr;
    dds_sample_info_t info;
    if (dds_take(publications_.handle(), &sample, &info, 1, 1) < 1) break;
    const auto& endpoint = *static_cast<const dds_builtintopic_endpoint_t*>(sample);
    Guid key, participant;
    std::copy(std::begin(endpoint.key.v), std::end(endpoint.key.v), key.begin());
    if (info.instance_state == DDS_ALIVE_INSTANCE_STATE && info.valid_data) {
      std::copy(std::begin(endpoint.participant_key.v),
                std::end(endpoint.participant_key.v),
                participant.begin());
      if (participant != guid_) {
        offers_[key] = {RosTopicName(endpoint.topic_name),
                        RosTypeName(endpoint.type_name),
                        IsReliable(endpoint.qos)};
        changed = true;
      }
    } else {
      changed = offers_.erase(key) > 0 || changed;
    }
    dds_return_loan(publications_.handle(), &sample, 1);
  }
  return changed;
}

std::vector<Offer> Node::offers() const {
  std::vector<Offer> offers;
  for (const auto& [key, offer] : offers_) offers.push_back(offer);
  return offers;
}

}  // namespace strata::ros2
