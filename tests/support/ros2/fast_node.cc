#include "tests/support/ros2/fast_node.h"

#include <atomic>
#include <cstdint>
#include <cstring>
#include <functional>
#include <map>
#include <memory>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include <fastdds/dds/domain/DomainParticipant.hpp>
#include <fastdds/dds/domain/DomainParticipantFactory.hpp>
#include <fastdds/dds/publisher/DataWriter.hpp>
#include <fastdds/dds/publisher/DataWriterListener.hpp>
#include <fastdds/dds/publisher/Publisher.hpp>
#include <fastdds/dds/subscriber/DataReader.hpp>
#include <fastdds/dds/subscriber/DataReaderListener.hpp>
#include <fastdds/dds/subscriber/SampleInfo.hpp>
#include <fastdds/dds/subscriber/Subscriber.hpp>
#include <fastdds/dds/topic/TopicDataType.hpp>
#include <fastdds/dds/topic/TypeSupport.hpp>
#include <fastdds/rtps/transport/UDPv4TransportDescriptor.h>
#include <fastrtps/utils/IPLocator.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

namespace strata::testing {
namespace {

namespace dds = eprosima::fastdds::dds;
namespace rtps = eprosima::fastrtps::rtps;

constexpr std::uint32_t kBufferBytes = 4U << 20;

[[noreturn]] void Fail(const std::string& what) { throw std::runtime_error("Fast DDS: " + what); }

// A message that is CDR already.
class CdrType : public dds::TopicDataType {
 public:
  explicit CdrType(const std::string& name) {
    setName(name.c_str());
    m_typeSize = 256;  // grows with what comes
    m_isGetKeyDefined = false;
  }
  bool serialize(void* data, rtps::SerializedPayload_t* payload) override {
    const auto& bytes = *static_cast<const std::string*>(data);
    payload->reserve(static_cast<std::uint32_t>(bytes.size()));
    std::memcpy(payload->data, bytes.data(), bytes.size());
    payload->length = static_cast<std::uint32_t>(bytes.size());
    payload->encapsulation = CDR_LE;
    return true;
  }
  bool deserialize(rtps::SerializedPayload_t* payload, void* data) override {
    static_cast<std::string*>(data)->assign(reinterpret_cast<const char*>(payload->data),
                                            payload->length);
    return true;
  }
  std::function<std::uint32_t()> getSerializedSizeProvider(void* data) override {
    return [data] { return static_cast<std::uint32_t>(static_cast<std::string*>(data)->size()); };
  }
  void* createData() override { return new std::string; }
  void deleteData(void* data) override { delete static_cast<std::string*>(data); }
  bool getKey(void*, rtps::InstanceHandle_t*, bool) override { return false; }
};

// "nav_msgs/Path" as rmw_fastrtps has it.
std::string WireType(const std::string& type) {
  const std::size_t slash = type.find('/');
  return type.substr(0, slash) + "::msg::dds_::" + type.substr(slash + 1) + "_";
}

struct Reading : dds::DataReaderListener {
  explicit Reading(std::function<void(const std::string&)> function) : heard(std::move(function)) {}
  void on_data_available(dds::DataReader* reader) override {
    std::string cdr;
    dds::SampleInfo info;
    while (reader->take_next_sample(&cdr, &info) ==
           eprosima::fastrtps::types::ReturnCode_t::RETCODE_OK) {
      if (info.valid_data) heard(cdr);
    }
  }
  void on_subscription_matched(dds::DataReader*,
                               const dds::SubscriptionMatchedStatus& status) override {
    *writers = status.current_count;
  }
  std::function<void(const std::string&)> heard;
  std::shared_ptr<std::atomic<int>> writers = std::make_shared<std::atomic<int>>(0);
};

struct Matches : dds::DataWriterListener {
  void on_publication_matched(dds::DataWriter*, const dds::PublicationMatchedStatus& s) override {
    readers = s.current_count;
  }
  std::atomic<int> readers = 0;
};

}  // namespace

struct FastNode::Writer::State {
  Matches matches;
  dds::DataWriter* writer = nullptr;
};

struct FastNode::State {
  dds::DomainParticipant* participant = nullptr;
  dds::Publisher* publisher = nullptr;
  dds::Subscriber* subscriber = nullptr;
  std::map<std::string, dds::Topic*> topics;
  std::vector<std::shared_ptr<FastNode::Writer::State>> writers;
  std::vector<std::unique_ptr<Reading>> readings;

  dds::Topic* TopicOf(const std::string& topic, const std::string& type) {
    dds::Topic*& known = topics[topic];
    if (known != nullptr) return known;
    dds::TypeSupport support(new CdrType(WireType(type)));
    support.register_type(participant);
    known = participant->create_topic("rt" + topic, WireType(type), dds::TOPIC_QOS_DEFAULT);
    if (known == nullptr) Fail("topic " + topic);
    return known;
  }
};

FastNode::FastNode(int domain) : state_(std::make_unique<State>()) {
  dds::DomainParticipantQos qos;
  qos.name("robot");
  qos.transport().use_builtin_transports = false;
  auto udp = std::make_shared<eprosima::fastdds::rtps::UDPv4TransportDescriptor>();
  udp->interfaceWhiteList.push_back("127.0.0.1");
  udp->sendBufferSize = udp->receiveBufferSize = kBufferBytes;
  udp->maxInitialPeersRange = 32;
  qos.transport().user_transports.push_back(udp);
  rtps::Locator_t peer;
  rtps::IPLocator::setIPv4(peer, 127, 0, 0, 1);
  qos.wire_protocol().builtin.initialPeersList.push_back(peer);
  auto* const factory = dds::DomainParticipantFactory::get_instance();
  state_->participant = factory->create_participant(static_cast<dds::DomainId_t>(domain), qos);
  if (state_->participant == nullptr) Fail("no participant");
  state_->publisher = state_->participant->create_publisher(dds::PUBLISHER_QOS_DEFAULT);
  state_->subscriber = state_->participant->create_subscriber(dds::SUBSCRIBER_QOS_DEFAULT);
}

FastNode::~FastNode() {
  state_->participant->delete_contained_entities();
  dds::DomainParticipantFactory::get_instance()->delete_participant(state_->participant);
}

FastNode::Writer FastNode::Advertise(const std::string& topic,
                                     const std::string& type,
                                     const FastQos& wanted) {
  dds::DataWriterQos qos;
  qos.reliability().kind =
      wanted.reliable ? dds::RELIABLE_RELIABILITY_QOS : dds::BEST_EFFORT_RELIABILITY_QOS;
  qos.reliability().max_blocking_time = eprosima::fastrtps::Duration_t(1, 0);
  qos.durability().kind =
      wanted.transient_local ? dds::TRANSIENT_LOCAL_DURABILITY_QOS : dds::VOLATILE_DURABILITY_QOS;
  qos.history().depth = wanted.depth;
  qos.publish_mode().kind = dds::ASYNCHRONOUS_PUBLISH_MODE;
  qos.endpoint().history_memory_policy = rtps::PREALLOCATED_WITH_REALLOC_MEMORY_MODE;
  // What was not acknowledged is asked for soon: the robot does not wait for seconds.
  qos.reliable_writer_qos().times.heartbeatPeriod = eprosima::fastrtps::Duration_t(0.1);
  Writer writer;
  writer.state_ = std::make_shared<Writer::State>();
  state_->writers.push_back(writer.state_);
  writer.state_->writer = state_->publisher->create_datawriter(
      state_->TopicOf(topic, type), qos, &writer.state_->matches);
  if (writer.state_->writer == nullptr) Fail("writer of " + topic);
  return writer;
}

bool FastNode::Writer::Write(const std::string& cdr) {
  return state_->writer->write(const_cast<std::string*>(&cdr));
}

int FastNode::Writer::readers() const { return state_->matches.readers; }

int FastNode::Reader::writers() const { return *writers_; }

FastNode::Reader FastNode::Subscribe(const std::string& topic,
                                     const std::string& type,
                                     const FastQos& wanted,
                                     std::function<void(const std::string&)> heard) {
  dds::DataReaderQos qos;
  qos.reliability().kind =
      wanted.reliable ? dds::RELIABLE_RELIABILITY_QOS : dds::BEST_EFFORT_RELIABILITY_QOS;
  qos.durability().kind =
      wanted.transient_local ? dds::TRANSIENT_LOCAL_DURABILITY_QOS : dds::VOLATILE_DURABILITY_QOS;
  qos.history().depth = wanted.depth;
  qos.endpoint().history_memory_policy = rtps::PREALLOCATED_WITH_REALLOC_MEMORY_MODE;
  state_->readings.push_back(std::make_unique<Reading>(std::move(heard)));
  if (state_->subscriber->create_datareader(
          state_->TopicOf(topic, type), qos, state_->readings.back().get()) == nullptr) {
    Fail("reader of " + topic);
  }
  Reader reader;
  reader.writers_ = state_->readings.back()->writers;
  return reader;
}

// Names of sockets that are in no folder end with their processes.
TestDomain::TestDomain() {
  constexpr int kFirst = 20, kLast = 200;
  for (int i = 0; i <= kLast - kFirst; ++i) {
    number_ = kFirst + (static_cast<int>(getpid()) + i) % (kLast - kFirst + 1);
    const std::string name = "strata-test-dds-domain-" + std::to_string(number_);
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    std::memcpy(address.sun_path + 1, name.data(), name.size());
    socket_ = socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
    const auto length = static_cast<socklen_t>(offsetof(sockaddr_un, sun_path) + 1 + name.size());
    if (bind(socket_, reinterpret_cast<const sockaddr*>(&address), length) == 0) return;
    close(socket_);
  }
  throw std::runtime_error("no domain is free");
}

TestDomain::~TestDomain() { close(socket_); }

}  // namespace strata::testing
